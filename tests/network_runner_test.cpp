// SPDX-License-Identifier: BSD-3-Clause
// Each step of the own inference engine against the plain computation, for every instruction set that this
// processor has.
#include "roslam/inference/network_runner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/network_hash.hpp"
#include "tests/plain_network.hpp"

namespace roslam {
namespace {

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

}  // namespace
}  // namespace roslam
