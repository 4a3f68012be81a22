// SPDX-License-Identifier: BSD-3-Clause
#include "roslam/inference/network_runner.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <new>
#include <string>
#include <utility>

#include "roslam/common/error.hpp"

namespace roslam {

namespace {
constexpr std::align_val_t kCacheLine{64};
constexpr int kLargestSide = 8192;
// Of all buffers, as memory is only lent until it is used.
constexpr std::size_t kMostFloats = std::size_t{1} << 30U;

[[noreturn]] void refuse_size(const PlannedStep& step) {
  throw ModelError("layer " + step.layer +
                   ": does not work at this image size; use sides that are multiples of 32");
}
}  // namespace

FloatBuffer::FloatBuffer(std::size_t size)
    : data_(static_cast<float*>(::operator new[](size * sizeof(float), kCacheLine))) {
  std::memset(data_.get(), 0, size * sizeof(float));
}

void FloatBuffer::Free::operator()(float* data) const { ::operator delete[](data, kCacheLine); }

NetworkRunner::NetworkRunner(NetworkPlan plan, const Kernels& kernels, int threads)
    : plan_(std::move(plan)), kernels_(kernels), team_(threads) {
  for (PlannedStep& step : plan_.steps) pack(std::move(step));
  plan_.steps.clear();
}

std::ptrdiff_t NetworkRunner::padded(int channels) const {
  return (channels + kernels_.lanes - 1) / kernels_.lanes * kernels_.lanes;
}

float NetworkRunner::mean(int channel) const {
  return plan_.mean.empty() ? 0.0F : plan_.mean[static_cast<std::size_t>(channel)];
}

float NetworkRunner::deviation(int channel) const {
  return plan_.deviation.empty() ? 1.0F : plan_.deviation[static_cast<std::size_t>(channel)];
}

void NetworkRunner::set_input(const float* planes) {
  const TensorView& in = views_[0];
  for (int c = 0; c < in.channels; ++c) {
    const float subtracted = mean(c);
    const float divisor = deviation(c);
    for (int y = 0; y < in.rows; ++y) {
      for (int x = 0; x < in.columns; ++x) in.at(y, x)[c] = (*planes++ - subtracted) / divisor;
    }
  }
}

// Reorders weights from output, input, row, column to what the kernels read in sequence.
void NetworkRunner::pack(PlannedStep step) {
  PackedStep packed;
  const int taps = step.kernel * step.kernel;
  const int outputs = static_cast<int>(step.bias.size());
  if (step.kind == StepKind::kConvolution) {
    const int inputs = static_cast<int>(step.weights.size()) / taps / outputs;
    packed.weights = FloatBuffer(static_cast<std::size_t>(padded(outputs) * taps * inputs));
    float* to = packed.weights.data();
    for (int first = 0; first < outputs; first += kernels_.panel) {
      const int width = static_cast<int>(padded(std::min(kernels_.panel, outputs - first)));
      for (int t = 0; t < taps; ++t) {
        for (int i = 0; i < inputs; ++i) {
          for (int o = 0; o < width; ++o, ++to) {
            if (first + o < outputs)
              *to = step.weights[static_cast<std::size_t>(((first + o) * inputs + i) * taps + t)];
          }
        }
      }
    }
    packed.bias = FloatBuffer(static_cast<std::size_t>(padded(outputs)));
    std::copy(step.bias.begin(), step.bias.end(), packed.bias.data());
  }
  if (step.kind == StepKind::kSingleConvolution) {
    const int inputs = static_cast<int>(step.weights.size()) / taps;
    const int whole = (inputs + kSlack - 1) / kSlack * kSlack;
    packed.weights = FloatBuffer(static_cast<std::size_t>(whole * taps));
    for (int t = 0; t < taps; ++t) {
      for (int i = 0; i < inputs; ++i)
        packed.weights.data()[t * whole + i] = step.weights[static_cast<std::size_t>(i * taps + t)];
    }
  }
  if (step.depthwise) {
    const int channels = static_cast<int>(step.depthwise->bias.size());
    const std::ptrdiff_t whole = padded(channels);
    packed.depthwise_weights = FloatBuffer(static_cast<std::size_t>(9 * whole));
    packed.depthwise_bias = FloatBuffer(static_cast<std::size_t>(whole));
    for (int c = 0; c < channels; ++c) {
      packed.depthwise_bias.data()[c] = step.depthwise->bias[static_cast<std::size_t>(c)];
      for (int t = 0; t < 9; ++t)
        packed.depthwise_weights.data()[t * whole + c] =
            step.depthwise->weights[static_cast<std::size_t>(c * 9 + t)];
    }
    step.depthwise->weights.clear();
  }
  if (step.kind == StepKind::kSingleConvolution || step.kind == StepKind::kConvolution) {
    step.weights.clear();
    step.weights.shrink_to_fit();
  }
  packed.plan = std::move(step);
  steps_.push_back(std::move(packed));
}

double NetworkRunner::multiply_adds() const {
  double sum = 0.0;
  for (const PackedStep& step : steps_) {
    if (step.plan.kind != StepKind::kConvolution && step.plan.kind != StepKind::kSingleConvolution) continue;
    const TensorView& out = view(step.plan.output);
    const double inputs = view(step.plan.input).channels;
    const double pixel =
        inputs * step.plan.kernel * step.plan.kernel * static_cast<double>(step.plan.bias.size()) +
        (step.plan.depthwise ? 9.0 * inputs : 0.0);
    sum += pixel * out.rows * out.columns;
  }
  return sum;
}

// --- sizes and memory -------------------------------------------------------------------------------------

NetworkRunner::Size NetworkRunner::size_after(const PlannedStep& step, const std::vector<Size>& sizes) const {
  const auto of = [&](int tensor) {
    const Size& size = sizes[static_cast<std::size_t>(root_of(tensor))];
    if (size.rows < 1 || size.columns < 1) refuse_size(step);
    return size;
  };
  const auto need = [&](bool condition) {
    if (!condition) refuse_size(step);
  };
  const Size in = of(step.input);
  Size out = in;
  switch (step.kind) {
    case StepKind::kConvolution:
    case StepKind::kSingleConvolution: {
      const int stride = step.depthwise ? step.depthwise->stride : step.stride;
      out = {(in.rows - 1) / stride + 1, (in.columns - 1) / stride + 1};
      break;
    }
    case StepKind::kAveragePool:
    case StepKind::kMaxPool:
      out = {(in.rows + 2 * step.padding - step.kernel) / step.stride + 1,
             (in.columns + 2 * step.padding - step.kernel) / step.stride + 1};
      need(in.rows + 2 * step.padding >= step.kernel && in.columns + 2 * step.padding >= step.kernel);
      break;
    case StepKind::kUpsample:
    case StepKind::kDepthToSpace:
      out = {2 * in.rows, 2 * in.columns};
      break;
    case StepKind::kGlobalAverage:
      out = {1, 1};
      break;
    case StepKind::kRegionNorm:
      need(in.rows % 8 == 0 && in.columns % 8 == 0);  // or the exported means leave out a part
      for (const PlannedRegion& region : step.regions) {
        const Size share = of(region.tensor);
        need(share.rows == in.rows && share.columns == in.columns);
      }
      break;
    default:
      break;
  }
  if (step.second >= 0) {
    const Size second = of(step.second);
    const int factor = step.doubles_second ? 2 : 1;
    const bool is_same = factor * second.rows == out.rows && factor * second.columns == out.columns;
    const bool is_spread = step.kind == StepKind::kBinary && second.rows == 1 && second.columns == 1;
    need(is_same || is_spread);
  }
  need(out.rows <= 2 * kLargestSide && out.columns <= 2 * kLargestSide);
  return out;
}

// The size of each tensor that is not part of another one.
std::vector<NetworkRunner::Size> NetworkRunner::sizes_for(int rows, int columns) const {
  std::vector<Size> sizes(plan_.tensors.size());
  sizes[0] = {rows, columns};
  for (const PackedStep& step : steps_) {
    const Size size = size_after(step.plan, sizes);
    Size& known = sizes[static_cast<std::size_t>(root_of(step.plan.output))];
    if (known.rows != 0 && (known.rows != size.rows || known.columns != size.columns)) refuse_size(step.plan);
    known = size;
  }
  return sizes;
}

int NetworkRunner::root_of(int tensor) const {
  while (plan_.tensors[static_cast<std::size_t>(tensor)].parent >= 0)
    tensor = plan_.tensors[static_cast<std::size_t>(tensor)].parent;
  return tensor;
}

void NetworkRunner::prepare(int rows, int columns) {
  if (!views_.empty() && views_[0].rows == rows && views_[0].columns == columns) return;
  if (rows < 1 || columns < 1 || rows > kLargestSide || columns > kLargestSide)
    throw ModelError("takes images of 1 to " + std::to_string(kLargestSide) + " pixels a side");
  const std::vector<Size> sizes = sizes_for(rows, columns);
  views_.clear();
  memory_.clear();
  try {
    allocate(sizes);
    scratch_.clear();
    const auto scratch = static_cast<std::size_t>(scratch_needed());
    for (int i = 0; i < team_.size(); ++i) scratch_.emplace_back(scratch);
  } catch (...) {
    views_.clear();
    memory_.clear();
    throw;
  }
}

// The last step that reads or writes each tensor that is not part of another one.
std::vector<int> NetworkRunner::last_uses() const {
  std::vector<int> last(plan_.tensors.size(), 0);
  const auto use = [&](int tensor, std::size_t step) {
    if (tensor >= 0) last[static_cast<std::size_t>(root_of(tensor))] = static_cast<int>(step);
  };
  for (std::size_t s = 0; s < steps_.size(); ++s) {
    const PlannedStep& step = steps_[s].plan;
    for (const int tensor : {step.input, step.second, step.output}) use(tensor, s);
    for (const PlannedRegion& region : step.regions) use(region.tensor, s);
  }
  use(plan_.output, steps_.size());
  use(0, steps_.size());  // written before the run
  return last;
}

// Tensors share memory with earlier ones of the same shape, so that nothing is ever written to a border,
// which stays zero.
void NetworkRunner::place(int root, const Size& size, int first_use, int last_use) {
  TensorView& view = views_[static_cast<std::size_t>(root)];
  if (view.data != nullptr) return;
  const PlannedTensor& tensor = plan_.tensors[static_cast<std::size_t>(root)];
  view = {nullptr, size.rows, size.columns, tensor.channels, tensor.channels, 0};
  view.row_step = static_cast<std::ptrdiff_t>(size.columns + 2 * tensor.border) * tensor.channels;
  const std::array key{size.rows, size.columns, tensor.channels, tensor.border};
  auto found = std::find_if(memory_.begin(), memory_.end(),
                            [&](const Memory& m) { return m.key == key && m.free_after < first_use; });
  if (found == memory_.end()) {
    const auto floats =
        static_cast<std::size_t>(view.row_step) * static_cast<std::size_t>(size.rows + 2 * tensor.border) +
        2 * kSlack;
    floats_ += floats;
    if (floats_ > kMostFloats) throw std::bad_alloc();
    memory_.push_back({FloatBuffer(floats), key, -1});
    found = memory_.end() - 1;
  }
  found->free_after = last_use;
  view.data = found->buffer.data() + tensor.border * (view.row_step + view.pixel_step);
}

void NetworkRunner::allocate(const std::vector<Size>& sizes) {
  const std::vector<int> last = last_uses();
  views_.assign(plan_.tensors.size(), {});
  floats_ = 0;
  std::size_t sums = 0;
  place(0, sizes[0], -1, last[0]);
  for (std::size_t s = 0; s < steps_.size(); ++s) {
    const PlannedStep& step = steps_[s].plan;
    const int root = root_of(step.output);
    const Size& size = sizes[static_cast<std::size_t>(root)];
    place(root, size, static_cast<int>(s), last[static_cast<std::size_t>(root)]);
    if (step.kind == StepKind::kRegionNorm) {
      const std::ptrdiff_t channels = padded(plan_.tensors[static_cast<std::size_t>(step.output)].channels);
      sums = std::max(sums, static_cast<std::size_t>((size.rows + 1) * 2 * kMaxRegions * channels));
    }
  }
  region_sums_ = FloatBuffer(sums);
  for (std::size_t i = 0; i < views_.size(); ++i) {  // ranges of channels
    std::ptrdiff_t offset = 0;
    auto t = static_cast<int>(i);
    for (; plan_.tensors[static_cast<std::size_t>(t)].parent >= 0;
         t = plan_.tensors[static_cast<std::size_t>(t)].parent)
      offset += plan_.tensors[static_cast<std::size_t>(t)].offset;
    const TensorView root = views_[static_cast<std::size_t>(t)];
    if (root.data == nullptr || static_cast<int>(i) == t) continue;
    views_[i] = root;
    views_[i].data += offset;
    views_[i].channels = plan_.tensors[i].channels;
  }
}

std::ptrdiff_t NetworkRunner::scratch_needed() const {
  std::ptrdiff_t most = 0;
  for (const PackedStep& step : steps_) {
    const TensorView& out = view(step.plan.output);
    std::ptrdiff_t floats = padded(view(step.plan.input).channels);
    if (step.plan.depthwise)
      floats += padded(static_cast<int>(step.plan.depthwise->bias.size())) * out.columns;
    if (step.plan.doubles_second || step.plan.kind == StepKind::kUpsample)
      floats += 2 * padded(out.channels) * out.columns;
    most = std::max(most, floats);
  }
  return most + 2 * kSlack;
}

}  // namespace roslam
