#include "planar_vslam/pipeline/blind_drift.h"

#include <gtest/gtest.h>

#include <cmath>

namespace planar_vslam {
namespace {

SystematicErrors Errors() {
  SystematicErrors errors;
  errors.wheels = 0.01;
  errors.turn = 0.02;
  return errors;
}

TEST(BlindDrift, GrowsInFullWithTheWayAndNotWithItsRoot) {
  BlindDrift drift(Errors());
  for (int step = 0; step < 100; ++step) drift.Move(Rigid2(0.1, 0.0, 0.0));
  EXPECT_NEAR(std::sqrt(drift.Covariance()(0, 0)), 0.10, 1e-9) << "one per cent of ten metres";
}

// Once in ten metres wheels slip by three degrees.
TEST(BlindDrift, KnowsThatWheelsSlip) {
  constexpr double kSlip = DegreesToRadians(3.0), kWay = 10.0;
  BlindDrift drift(SystematicErrors{});
  for (int step = 0; step < 1000; ++step) drift.Move(Rigid2(0.001 * kWay, 0.0, 0.0));
  EXPECT_NEAR(std::sqrt(drift.Covariance()(2, 2)), kSlip, 1e-9);
  EXPECT_NEAR(std::sqrt(drift.Covariance()(1, 1)), kSlip * kWay / std::sqrt(3.0), 1e-3) << "anywhere on the way";
}

TEST(BlindDrift, CarriesATurnReadWrongIntoThePlaceDrivenTo) {
  BlindDrift drift(Errors());
  for (int step = 0; step < 90; ++step) drift.Move(Rigid2(0.0, 0.0, DegreesToRadians(1.0)));
  EXPECT_NEAR(std::sqrt(drift.Covariance()(2, 2)), DegreesToRadians(1.8), 1e-9);
  const double heading = drift.Covariance()(2, 2);
  drift.Move(Rigid2(5.0, 0.0, 0.0));
  EXPECT_NEAR(std::sqrt(drift.Covariance()(1, 1)), 5.0 * DegreesToRadians(1.8), 1e-9) << "sideways, 5 m ahead";
  EXPECT_NEAR(drift.Covariance()(1, 2), 5.0 * heading, 1e-9);
}

TEST(BlindDrift, IsGoneOnceThePoseIsConfirmed) {
  BlindDrift drift(Errors());
  drift.Move(Rigid2(3.0, 0.0, 0.2));
  drift.Forget();
  EXPECT_EQ(drift.Covariance().norm(), 0.0);
}

}  // namespace
}  // namespace planar_vslam
