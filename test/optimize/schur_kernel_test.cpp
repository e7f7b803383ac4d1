#include "schur_kernel.h"

#include <gtest/gtest.h>

#include <random>

namespace planar_vslam {
namespace {

class SchurKernel : public ::testing::TestWithParam<InstructionSet> {
 protected:
  static ViewFactor Random(std::mt19937* generator) {
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    return ViewFactor::NullaryExpr([&] { return uniform(*generator); });
  }
};
INSTANTIATE_TEST_SUITE_P(Sets, SchurKernel, ::testing::ValuesIn(UsableInstructionSets()));

TEST_P(SchurKernel, TakesTheProductsOfAllPairsAndNothingElse) {
  std::mt19937 generator(1);
  const std::vector<Eigen::Index> rows{0, 12, 18};
  std::vector<ViewFactor> U;
  for (std::size_t a = 0; a < rows.size(); ++a) U.push_back(Random(&generator));
  Eigen::MatrixXd S = Eigen::MatrixXd::Ones(24, 24), expected = S;
  for (std::size_t a = 0; a < rows.size(); ++a) {
    for (std::size_t c = 0; c <= a; ++c) expected.block<6, 6>(rows[a], rows[c]) -= U[a].transpose() * U[c];
  }
  SubtractPairsOf(GetParam())(U, rows, S.rows(), S.data());
  EXPECT_LT((S - expected).norm(), 1e-14);
}

TEST_P(SchurKernel, GivesTheBitsOfThePlainOne) {
  std::mt19937 generator(2);
  std::vector<ViewFactor> U;
  std::vector<Eigen::Index> rows;
  for (Eigen::Index row = 0; row < 60; row += 6) {
    U.push_back(Random(&generator));
    rows.push_back(row);
  }
  Eigen::MatrixXd S = Eigen::MatrixXd::Random(60, 60), plain = S;
  SubtractPairsOf(GetParam())(U, rows, S.rows(), S.data());
  SubtractPairsOf(InstructionSet::kPlain)(U, rows, plain.rows(), plain.data());
  EXPECT_EQ(S, plain);
}

}  // namespace
}  // namespace planar_vslam
