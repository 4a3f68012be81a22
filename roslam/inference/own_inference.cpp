// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <new>

#include "roslam/common/error.hpp"
#include "roslam/inference/inference.hpp"
#include "roslam/inference/network_runner.hpp"
#include "roslam/inference/plan/onnx_graph.hpp"
#include "roslam/inference/score_grid.hpp"

namespace roslam {

namespace {
class OwnInference : public Inference {
 public:
  OwnInference(NetworkPlan plan, const Kernels& kernels, int threads, std::filesystem::path model)
      : runner_(std::move(plan), kernels, threads), model_(std::move(model)) {}

  cv::Mat run(const cv::Mat& input) override {
    if (input.dims != 4 || input.type() != CV_32F || input.size[0] != 1)
      throw ModelError(model_.string() + ": the network cannot be run (its input has another shape)");
    prepare(input.size[1], input.size[2], input.size[3]);
    runner_.set_input(input.ptr<float>());
    return planes_of(runner_.run());
  }

  ScoreGrid scores(const cv::Mat& image) override {
    prepare(3, image.rows, image.cols);
    read_image(image);
    const NetworkOutput output = runner_.run();
    if (output.lanes != kScoreLanes) return ScoreGrid::from_planes(planes_of(output));
    ScoreGrid grid;
    grid.scores = output;
    grid.best.resize(static_cast<std::size_t>(output.rows()) * static_cast<std::size_t>(output.columns()));
    grid.probability.create(output.rows(), output.columns(), CV_32FC1);
    for (int y = 0; y < output.rows(); ++y) {
      runner_.kernels().label({output.at(y, 0), output.tensor.pixel_step, output.tensor.columns,
                               output.sub_pixels, &grid.best[grid.index(y, 0)],
                               grid.probability.ptr<float>(y)});
    }
    return grid;
  }

  std::string backend() const override { return std::string("own (") + runner_.kernels().name + ")"; }

 private:
  // 1 x channels x rows x columns.
  cv::Mat planes_of(const NetworkOutput& output) {
    const std::array size{1, output.channels, output.rows(), output.columns()};
    planes_.create(static_cast<int>(size.size()), size.data(), CV_32F);
    for (int y = 0; y < output.rows(); ++y) {
      for (int x = 0; x < output.columns(); ++x) {
        const float* from = output.at(y, x);
        for (int c = 0; c < output.channels; ++c)
          planes_.ptr<float>(0, c)[y * output.columns() + x] = from[c];
      }
    }
    return planes_;
  }

  void prepare(int channels, int rows, int columns) {
    if (channels != runner_.input_channels()) {
      throw ModelError(model_.string() + ": the network cannot be run (it takes " +
                       std::to_string(runner_.input_channels()) + " channels, not " +
                       std::to_string(channels) + "); install the model that belongs to this version");
    }
    try {
      runner_.prepare(rows, columns);
    } catch (const std::bad_alloc&) {
      throw MemoryError(
          model_.string() +
          ": needs more memory than is left; close other programs or choose a smaller working side");
    } catch (const ModelError& error) {
      throw ModelError(model_.string() + ": the network cannot be run (" + error.what() + ")");
    }
  }

  // 8-bit BGR to normalised RGB by a table, whose values are those of the computation in floats.
  void read_image(const cv::Mat& image) {
    if (tables_[0].empty()) {
      for (int c = 0; c < 3; ++c) {
        auto& table = tables_[static_cast<std::size_t>(c)];
        for (int value = 0; value < 256; ++value) {
          const float share = static_cast<float>(value * (1.0 / 255.0));
          table.push_back((share - runner_.mean(c)) / runner_.deviation(c));
        }
      }
    }
    const TensorView view = runner_.input();
    for (int y = 0; y < view.rows; ++y) {
      const auto* bgr = image.ptr<std::uint8_t>(y);
      float* to = view.at(y, 0);
      for (int x = 0; x < view.columns; ++x, bgr += 3, to += view.pixel_step) {
        for (std::size_t c = 0; c < 3; ++c) to[c] = tables_[c][bgr[2 - c]];
      }
    }
  }

  NetworkRunner runner_;
  std::filesystem::path model_;
  std::array<std::vector<float>, 3> tables_;  // by channel and 8-bit value
  cv::Mat planes_;
};
}  // namespace

std::string own_instruction_set() {
  const Kernels* kernels = best_kernels();
  return kernels == nullptr ? std::string() : kernels->name;
}

std::unique_ptr<Inference> load_own_inference(const std::string& bytes, const std::filesystem::path& model,
                                              int threads) {
  const Kernels* kernels = best_kernels();
  if (kernels == nullptr) {
    throw ModelError(model.string() +
                     ": the own inference engine needs a processor with AVX2 and FMA, or a 64-bit ARM one");
  }
  try {
    return std::make_unique<OwnInference>(plan_network(read_onnx(bytes)), *kernels, threads, model);
  } catch (const ModelError& error) {
    throw ModelError(model.string() + ": the own inference engine cannot run it (" + error.what() + ")");
  } catch (const std::bad_alloc&) {
    throw MemoryError(model.string() + ": needs more memory than is left; close other programs");
  }
}

}  // namespace roslam
