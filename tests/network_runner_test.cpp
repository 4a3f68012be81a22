// SPDX-License-Identifier: BSD-3-Clause
// Each step of the own inference engine against the plain computation, for every instruction set that this
// processor has, and the bits of whole networks against those of all others.
#include "roslam/inference/network_runner.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "roslam/common/error.hpp"
#include "tests/network_hash.hpp"

namespace roslam {
namespace {

const std::string kSegmenter = std::string(ROSLAM_MODELS) + "/roslam-pspnet.onnx";
const std::string kRestorer = std::string(ROSLAM_MODELS) + "/roslam-restorer-person.onnx";

std::vector<const Kernels*> runnable_kernels() {
  std::vector<const Kernels*> all;
  const Kernels* best = best_kernels();
  if (best == nullptr) return all;
  all.push_back(best);
  if (best == avx512_kernels() && avx2_kernels() != nullptr) all.push_back(avx2_kernels());
  return all;
}

// An image of doubles with zeros around it.
struct Plain {
  int rows = 0;
  int columns = 0;
  int channels = 0;
  std::vector<double> values;

  Plain(int r, int c, int n)
      : rows(r), columns(c), channels(n), values(static_cast<std::size_t>(r * c * n)) {}
  double& at(int y, int x, int c) {
    return values[static_cast<std::size_t>((y * columns + x) * channels + c)];
  }
  double get(int y, int x, int c) const {
    if (y < 0 || x < 0 || y >= rows || x >= columns) return 0.0;
    return values[static_cast<std::size_t>((y * columns + x) * channels + c)];
  }
};

class Numbers {
 public:
  float next() { return distribution_(generator_); }
  std::vector<float> list(int count) {
    std::vector<float> all;
    for (int i = 0; i < count; ++i) all.push_back(next());
    return all;
  }
  Plain image(int rows, int columns, int channels) {
    Plain made(rows, columns, channels);
    for (double& value : made.values) value = static_cast<double>(next());
    return made;
  }

 private:
  std::mt19937 generator_{7};
  std::uniform_real_distribution<float> distribution_{-1.0F, 1.0F};
};

Plain convolved(const Plain& in, const PlannedStep& step) {
  const int outputs = static_cast<int>(step.bias.size());
  Plain out((in.rows - 1) / step.stride + 1, (in.columns - 1) / step.stride + 1, outputs);
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      for (int o = 0; o < outputs; ++o) {
        double sum = static_cast<double>(step.bias[static_cast<std::size_t>(o)]);
        for (int i = 0; i < in.channels; ++i) {
          for (int t = 0; t < step.kernel * step.kernel; ++t) {
            const auto w = static_cast<std::size_t>((o * in.channels + i) * step.kernel * step.kernel + t);
            sum += static_cast<double>(step.weights[w]) *
                   in.get(y * step.stride - step.padding + t / step.kernel * step.dilation,
                          x * step.stride - step.padding + t % step.kernel * step.dilation, i);
          }
        }
        out.at(y, x, o) = sum;
      }
    }
  }
  return out;
}

Plain depthwise(const Plain& in, const DepthwiseWeights& weights) {
  const int s = weights.stride;
  Plain out((in.rows - 1) / s + 1, (in.columns - 1) / s + 1, in.channels);
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      for (int c = 0; c < in.channels; ++c) {
        double sum = static_cast<double>(weights.bias[static_cast<std::size_t>(c)]);
        for (int t = 0; t < 9; ++t)
          sum += static_cast<double>(weights.weights[static_cast<std::size_t>(c * 9 + t)]) *
                 in.get(y * s - 1 + t / 3, x * s - 1 + t % 3, c);
        out.at(y, x, c) = sum;
      }
    }
  }
  return out;
}

Plain upsampled(const Plain& in) {
  Plain out(2 * in.rows, 2 * in.columns, in.channels);
  const auto source = [](int i, int size, int& first, int& second) {
    const double position = std::clamp((i + 0.5) / 2.0 - 0.5, 0.0, size - 1.0);
    first = static_cast<int>(position);
    second = std::min(first + 1, size - 1);
    return position - first;
  };
  for (int y = 0; y < out.rows; ++y) {
    for (int x = 0; x < out.columns; ++x) {
      int y0, y1, x0, x1;
      const double down = source(y, in.rows, y0, y1);
      const double across = source(x, in.columns, x0, x1);
      for (int c = 0; c < in.channels; ++c)
        out.at(y, x, c) = (1 - down) * ((1 - across) * in.get(y0, x0, c) + across * in.get(y0, x1, c)) +
                          down * ((1 - across) * in.get(y1, x0, c) + across * in.get(y1, x1, c));
    }
  }
  return out;
}

void expect_near(const NetworkOutput& output, const Plain& expected, const char* what) {
  ASSERT_EQ(output.rows(), expected.rows) << what;
  ASSERT_EQ(output.columns(), expected.columns) << what;
  double worst = 0.0;
  for (int y = 0; y < expected.rows; ++y) {
    for (int x = 0; x < expected.columns; ++x) {
      for (int c = 0; c < expected.channels; ++c)
        worst = std::max(worst, std::abs(static_cast<double>(output.at(y, x)[c]) - expected.get(y, x, c)));
    }
  }
  EXPECT_LT(worst, 1e-4) << what;
}

// A plan of one step from tensor 0, which has the border that the step needs.
struct OneStep {
  NetworkPlan plan;
  PlannedStep step;

  OneStep(int inputs, int outputs, int border) {
    plan.tensors = {{inputs, border, -1, 0}, {outputs, 0, -1, 0}};
    step.input = 0;
    step.output = 1;
  }

  // Adds a tensor that a copy of the input's first channels fills.
  int add_copy(int channels) {
    plan.tensors.push_back({channels, 0, 0, 0});
    return static_cast<int>(plan.tensors.size()) - 1;
  }

  void expect(const Plain& input, const Plain& expected, const char* what) {
    plan.steps.push_back(step);
    plan.output = static_cast<int>(step.output);
    plan.output_channels = plan.lanes = expected.channels;
    for (const Kernels* kernels : runnable_kernels()) {
      for (const int threads : {1, 2}) {
        NetworkRunner runner(plan, *kernels, threads);
        runner.prepare(input.rows, input.columns);
        const TensorView view = runner.input();
        for (int y = 0; y < input.rows; ++y) {
          for (int x = 0; x < input.columns; ++x) {
            for (int c = 0; c < input.channels; ++c)
              view.at(y, x)[c] = static_cast<float>(input.get(y, x, c));
          }
        }
        expect_near(runner.run(), expected, what);
        expect_near(runner.run(), expected, what);  // nothing is left over from the run before
      }
    }
  }
};

class Channels : public testing::TestWithParam<std::pair<int, int>> {
 protected:
  int inputs() const { return GetParam().first; }
  int outputs() const { return GetParam().second; }
  Numbers numbers;
};

TEST_P(Channels, ConvolutionsOfAllShapes) {
  struct Shape {
    int kernel, stride, dilation;
  };
  for (const Shape shape : {Shape{1, 1, 1}, {1, 2, 1}, {3, 1, 1}, {3, 2, 1}, {3, 1, 2}, {3, 1, 4}}) {
    for (const bool relu : {false, true}) {
      const int padding = shape.dilation * (shape.kernel / 2);
      OneStep one(inputs(), outputs(), padding);
      one.step.kernel = shape.kernel;
      one.step.stride = shape.stride;
      one.step.dilation = shape.dilation;
      one.step.padding = padding;
      one.step.relu = relu;
      one.step.weights = numbers.list(outputs() * inputs() * shape.kernel * shape.kernel);
      one.step.bias = numbers.list(outputs());
      const Plain input = numbers.image(9, 29, inputs());
      Plain expected = convolved(input, one.step);
      for (double& value : expected.values) value = relu ? std::max(value, 0.0) : value;
      one.expect(input, expected, "convolution");
    }
  }
}

TEST_P(Channels, ConvolutionAfterADepthwiseOneWithResidual) {
  for (const int stride : {1, 2}) {
    OneStep one(inputs(), outputs(), 1);
    one.step.depthwise = DepthwiseWeights{stride, numbers.list(9 * inputs()), numbers.list(inputs())};
    one.step.weights = numbers.list(outputs() * inputs());
    one.step.bias = numbers.list(outputs());
    one.step.relu = true;
    const Plain input = numbers.image(10, 27, inputs());
    Plain expected = convolved(depthwise(input, *one.step.depthwise), one.step);
    if (stride == 1 && outputs() <= inputs()) {
      one.step.second = one.add_copy(outputs());
      for (int y = 0; y < 10; ++y) {
        for (int x = 0; x < 27; ++x) {
          for (int c = 0; c < outputs(); ++c) expected.at(y, x, c) += input.get(y, x, c);
        }
      }
    }
    for (double& value : expected.values) value = std::max(value, 0.0);
    one.expect(input, expected, "depthwise");
  }
}

TEST_P(Channels, SingleOutput) {
  for (const int dilation : {1, 2}) {
    OneStep one(inputs(), 1, dilation);
    one.step.kind = StepKind::kSingleConvolution;
    one.step.kernel = 3;
    one.step.dilation = one.step.padding = dilation;
    one.step.weights = numbers.list(9 * inputs());
    one.step.bias = numbers.list(1);
    const Plain input = numbers.image(8, 13, inputs());
    one.expect(input, convolved(input, one.step), "single output");
  }
}

TEST_P(Channels, UpsamplingAloneAndAsResidual) {
  const Plain input = numbers.image(5, 7, inputs());
  OneStep alone(inputs(), inputs(), 0);
  alone.step.kind = StepKind::kUpsample;
  alone.expect(input, upsampled(input), "upsampling");

  // The residual: the input upsampled is added to a convolution of the input upsampled before.
  OneStep both(inputs(), inputs(), 0);
  both.plan.tensors.push_back({inputs(), 0, -1, 0});
  both.step.kind = StepKind::kUpsample;
  both.plan.steps.push_back(both.step);
  PlannedStep convolution;
  convolution.input = 1;
  convolution.output = 2;
  convolution.second = 0;
  convolution.doubles_second = true;
  convolution.weights = numbers.list(inputs() * inputs());
  convolution.bias = numbers.list(inputs());
  both.step = convolution;
  Plain expected = convolved(upsampled(input), convolution);
  const Plain residual = upsampled(input);
  for (std::size_t i = 0; i < expected.values.size(); ++i) expected.values[i] += residual.values[i];
  both.expect(input, expected, "upsampled residual");
}

TEST_P(Channels, Pools) {
  const Plain input = numbers.image(12, 10, inputs());
  struct Shape {
    int kernel, stride, padding;
  };
  for (const Shape shape : {Shape{2, 2, 0}, {3, 1, 1}, {5, 1, 2}, {4, 4, 0}}) {
    OneStep one(inputs(), inputs(), shape.padding);
    one.step.kind = StepKind::kAveragePool;
    one.step.kernel = shape.kernel;
    one.step.stride = shape.stride;
    one.step.padding = shape.padding;
    Plain expected((12 + 2 * shape.padding - shape.kernel) / shape.stride + 1,
                   (10 + 2 * shape.padding - shape.kernel) / shape.stride + 1, inputs());
    for (int y = 0; y < expected.rows; ++y) {
      for (int x = 0; x < expected.columns; ++x) {
        for (int c = 0; c < inputs(); ++c) {
          double sum = 0.0;
          for (int i = 0; i < shape.kernel * shape.kernel; ++i)
            sum += input.get(y * shape.stride - shape.padding + i / shape.kernel,
                             x * shape.stride - shape.padding + i % shape.kernel, c);
          expected.at(y, x, c) = sum / (shape.kernel * shape.kernel);
        }
      }
    }
    one.expect(input, expected, "average pool");
  }
  OneStep most(inputs(), inputs(), 0);
  most.step.kind = StepKind::kMaxPool;
  most.step.kernel = most.step.stride = 2;
  Plain expected(6, 5, inputs());
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 5; ++x) {
      for (int c = 0; c < inputs(); ++c)
        expected.at(y, x, c) =
            std::max(std::max(input.get(2 * y, 2 * x, c), input.get(2 * y, 2 * x + 1, c)),
                     std::max(input.get(2 * y + 1, 2 * x, c), input.get(2 * y + 1, 2 * x + 1, c)));
    }
  }
  most.expect(input, expected, "maximum pool");
  OneStep all(inputs(), inputs(), 0);
  all.step.kind = StepKind::kGlobalAverage;
  Plain mean(1, 1, inputs());
  for (int c = 0; c < inputs(); ++c) {
    for (int i = 0; i < 120; ++i) mean.at(0, 0, c) += input.get(i / 10, i % 10, c) / 120.0;
  }
  all.expect(input, mean, "global average");
}

TEST_P(Channels, RegionNormalisationFollowsItsEquations) {
  if (inputs() < 4) GTEST_SKIP() << "the first channels are the regions";
  for (const int regions : {2, 3}) {
    Plain input = numbers.image(16, 24, inputs());
    for (int y = 0; y < 16; ++y) {  // shares of the regions in the first channels, 1 in sum
      for (int x = 0; x < 24; ++x) {
        const double first = 0.5 + 0.5 * input.get(y, x, 0);
        input.at(y, x, 0) = first;
        input.at(y, x, 1) = regions == 2 ? 1.0 - first : (1.0 - first) * 0.25;
        input.at(y, x, 2) = (1.0 - first) * 0.75;
      }
    }
    OneStep one(inputs(), inputs(), 0);
    one.step.kind = StepKind::kRegionNorm;
    one.step.relu = true;
    one.step.epsilon = 1e-5F;
    one.step.second = 0;
    for (int r = 0; r < regions; ++r) {
      one.plan.tensors.push_back({1, 0, 0, r});
      one.step.regions.push_back(
          {static_cast<int>(one.plan.tensors.size()) - 1, numbers.list(inputs()), numbers.list(inputs())});
    }
    Plain expected(16, 24, inputs());
    for (int c = 0; c < inputs(); ++c) {
      for (int r = 0; r < regions; ++r) {
        const auto& region = one.step.regions[static_cast<std::size_t>(r)];
        double share = 0.0, first = 0.0, second = 0.0;
        for (int i = 0; i < 16 * 24; ++i) {
          const double w = input.get(i / 24, i % 24, r);
          const double x = input.get(i / 24, i % 24, c);
          share += w;
          first += w * x;
          second += w * x * x;
        }
        const double mean = first / share;
        const double variance = second / share - mean * mean;
        for (int i = 0; i < 16 * 24; ++i) {
          const double normal = (input.get(i / 24, i % 24, c) - mean) / std::sqrt(variance + 1e-5);
          expected.at(i / 24, i % 24, c) +=
              input.get(i / 24, i % 24, r) *
              (normal * static_cast<double>(region.scale[static_cast<std::size_t>(c)]) +
               static_cast<double>(region.shift[static_cast<std::size_t>(c)]));
        }
      }
    }
    for (std::size_t i = 0; i < expected.values.size(); ++i)
      expected.values[i] = std::max(expected.values[i], 0.0) + input.values[i];
    one.expect(input, expected, "region normalisation");
  }
}

TEST_P(Channels, ElementByElement) {
  const Plain input = numbers.image(4, 9, inputs());
  const auto expect = [&](BinaryOperation operation, bool relu, const std::function<double(double)>& truth) {
    OneStep one(inputs(), inputs(), 0);
    one.step.kind = StepKind::kBinary;
    one.step.operation = operation;
    one.step.number = 0.25F;
    one.step.relu = relu;
    Plain expected = input;
    for (double& value : expected.values) value = truth(value);
    one.expect(input, expected, "with a number");
  };
  expect(BinaryOperation::kAdd, true, [](double x) { return std::max(x + 0.25, 0.0); });
  expect(BinaryOperation::kSubtract, false, [](double x) { return x - 0.25; });
  expect(BinaryOperation::kSubtractFrom, false, [](double x) { return 0.25 - x; });
  expect(BinaryOperation::kMultiply, false, [](double x) { return x * 0.25; });
  OneStep with_self(inputs(), inputs(), 0);
  with_self.step.kind = StepKind::kBinary;
  with_self.step.second = with_self.add_copy(1);  // one channel for all
  with_self.step.operation = BinaryOperation::kMultiply;
  Plain expected = input;
  for (int i = 0; i < 36; ++i) {
    for (int c = 0; c < inputs(); ++c) expected.at(i / 9, i % 9, c) *= input.get(i / 9, i % 9, 0);
  }
  with_self.expect(input, expected, "with one channel");
  OneStep squash(inputs(), inputs(), 0);
  squash.step.kind = StepKind::kSigmoid;
  expected = input;
  for (double& value : expected.values) value = 1.0 / (1.0 + std::exp(-value));
  squash.expect(input, expected, "sigmoid");
}

INSTANTIATE_TEST_SUITE_P(OfVectorsAndBetween, Channels,
                         testing::Values(std::pair(1, 1), std::pair(3, 16), std::pair(5, 24),
                                         std::pair(16, 32), std::pair(24, 7), std::pair(33, 48),
                                         std::pair(67, 65)));

TEST(Sigmoid, IsRightFarFromZero) {
  for (const Kernels* kernels : runnable_kernels()) {
    std::vector<float> values;
    for (float x = -120.0F; x <= 120.0F; x += 0.37F) values.push_back(x);
    std::vector<float> result = values;
    kernels->sigmoid(result.data(), result.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
      const double truth = 1.0 / (1.0 + std::exp(-static_cast<double>(values[i])));
      EXPECT_NEAR(static_cast<double>(result[i]), truth, 1e-6) << values[i];
    }
  }
}

TEST(Labels, AreTheHighestScoreAndItsSoftmaxProbability) {
  Numbers numbers;
  for (const Kernels* kernels : runnable_kernels()) {
    std::vector<float> scores = numbers.list(40 * kScoreLanes + kSlack);
    for (int point = 0; point < 40; ++point) {
      for (int c = 0; c < kScoreLanes; ++c)
        scores[static_cast<std::size_t>(point * kScoreLanes + c)] *= 20.0F;
      scores[static_cast<std::size_t>(point * kScoreLanes + 19)] = kLowestScore;
    }
    std::uint8_t best[40];
    float probability[40];
    kernels->label({scores.data(), 2 * kScoreLanes, 20, 2, best, probability});
    for (int point = 0; point < 40; ++point) {
      const float* all = scores.data() + point * kScoreLanes;
      const auto highest = std::max_element(all, all + 19);
      double sum = 0.0;
      for (int c = 0; c < 19; ++c) sum += std::exp(static_cast<double>(all[c] - *highest));
      EXPECT_EQ(best[point], highest - all);
      EXPECT_NEAR(static_cast<double>(probability[point]), 1.0 / sum, 1e-6);
    }
  }
}

// Every processor has to give these: NEON is checked by the test network_bits_neon.
TEST(Bits, AreTheSameOnAllProcessors) {
  if (runnable_kernels().empty()) GTEST_SKIP() << "this processor has no fused multiply-add";
  for (const Kernels* kernels : runnable_kernels()) {
    for (const int threads : {1, 2, 3}) {
      EXPECT_EQ(network_hash(kSegmenter, *kernels, 96, 128, threads), ROSLAM_SEGMENTER_HASH) << kernels->name;
      EXPECT_EQ(network_hash(kRestorer, *kernels, 256, 256, threads), ROSLAM_RESTORER_HASH) << kernels->name;
    }
  }
}

TEST(Bits, DoNotDependOnTheSizesBefore) {
  const Kernels* kernels = best_kernels();
  if (kernels == nullptr) GTEST_SKIP() << "this processor has no fused multiply-add";
  NetworkRunner runner(plan_network(read_onnx(file_content(kSegmenter))), *kernels, 1);
  for (const auto& [rows, columns] : {std::pair(32, 32), std::pair(320, 64), std::pair(96, 128)})
    output_hash(runner, rows, columns);
  EXPECT_EQ(output_hash(runner, 96, 128), ROSLAM_SEGMENTER_HASH);
}

TEST(Size, IsRefusedIfTheNetworkDoesNotWorkAtIt) {
  const Kernels* kernels = best_kernels();
  if (kernels == nullptr) GTEST_SKIP() << "this processor has no fused multiply-add";
  NetworkRunner runner(plan_network(read_onnx(file_content(kSegmenter))), *kernels, 1);
  for (const auto& [rows, columns] : {std::pair(0, 32), std::pair(-1, 5), std::pair(100000, 32),
                                      std::pair(33, 64), std::pair(40, 50), std::pair(1, 1)})
    EXPECT_THROW(runner.prepare(rows, columns), ModelError) << rows << "x" << columns;
  EXPECT_THROW(runner.prepare(8192, 8192), std::bad_alloc);        // 6 GB
  EXPECT_EQ(output_hash(runner, 96, 128), ROSLAM_SEGMENTER_HASH);  // and it still runs
}

}  // namespace
}  // namespace roslam
