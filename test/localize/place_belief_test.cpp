#include "planar_vslam/localize/place_belief.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "floor_plan.h"

namespace planar_vslam {
namespace {

using test::FloorPlan;

std::shared_ptr<const LikelihoodField> FieldOf(const std::vector<PosedSweep>& sweeps) {
  return std::make_shared<const LikelihoodField>(sweeps);
}

// Drives through `plan` from `T` on, `count` steps, and tells of each place what the laser sees. Where the robot is in
// the end.
Rigid2 Drive(const FloorPlan& plan, Rigid2 T, const Rigid2& step, int count, PlaceBelief* belief) {
  for (int i = 0; i < count; ++i) {
    belief->AddSweep(plan.Sweep(T, static_cast<unsigned>(i + 7)), FloorPlan::T_base_laser(), Rigid2());
    if (i + 1 == count) break;
    T = T * step;
    belief->Move(step);
  }
  return T;
}

void ExpectAt(const std::optional<Rigid2>& believed, const Rigid2& truth) {
  ASSERT_TRUE(believed.has_value());
  EXPECT_LT((believed->translation - truth.translation).norm(), 0.1);
  EXPECT_LT(std::abs(WrapAngle(believed->angle - truth.angle)), DegreesToRadians(3.0));
}

const Rigid2 kStep(0.25, 0.0, 0.1);

TEST(PlaceBelief, FindsTheOnlyPlaceThatFits) {
  PlaceBelief belief(FieldOf(test::MappedOffice()));
  const Rigid2 truth = Drive(test::Office(), Rigid2(1.0, 1.0, 0.3), kStep, 4, &belief);
  ExpectAt(belief.Believed(), truth);
  EXPECT_FALSE(belief.Contradicts(truth));
  EXPECT_TRUE(belief.Contradicts(truth * Rigid2(0.9, 0.4, 1.0)));
}

TEST(PlaceBelief, OneSweepIsNotEnough) {
  PlaceBelief belief(FieldOf(test::MappedOffice()));
  Drive(test::Office(), Rigid2(1.0, 1.0, 0.3), kStep, 1, &belief);
  EXPECT_FALSE(belief.Believed().has_value());
  for (int i = 0; i < 20; ++i) {  // nor are many from the same place
    EXPECT_FALSE(belief.AddSweep(test::Office().Sweep(Rigid2(1.0, 1.0, 0.3)), FloorPlan::T_base_laser(), Rigid2()));
  }
  if (belief.WantsView()) belief.AddView({});
  EXPECT_FALSE(belief.Believed().has_value()) << "nor a view from there";
}

TEST(PlaceBelief, ARobotThatStandsIsFoundByLaserAndCameraTogether) {
  const Rigid2 truth(1.0, 1.0, 0.3);
  for (const double odds : {1.0, 4.0}) {
    PlaceBelief belief(FieldOf(test::MappedOffice()));
    belief.AddSweep(test::Office().Sweep(truth), FloorPlan::T_base_laser(), Rigid2());
    EXPECT_FALSE(belief.Believed().has_value());
    belief.AddView({{truth, odds}});
    if (odds > 3.0) {
      ExpectAt(belief.Believed(), truth);
    } else {
      EXPECT_FALSE(belief.Believed().has_value()) << "the view hardly says so";
    }
  }
}

TEST(PlaceBelief, FindsItWhereFurnitureWasMoved) {
  FloorPlan changed;
  changed.Box(0, 0, 6, 4).Box(0, 3, 1.2, 4).Wall(5.2, 4, 5.2, 3.1).Box(2.0, 2.6, 2.7, 3.0);
  PlaceBelief belief(FieldOf(test::MappedOffice()));
  const Rigid2 truth = Drive(changed, Rigid2(1.0, 1.0, 0.3), kStep, 4, &belief);
  ExpectAt(belief.Believed(), truth);
}

TEST(PlaceBelief, NeverBelievesInARoomTheMapDoesNotKnow) {
  const auto field = FieldOf(test::MappedOffice());
  const FloorPlan workshop = test::Workshop();
  for (const double heading : {0.0, 1.3, 2.6, -2.4, -1.1}) {
    for (const Rigid2& step : {kStep, Rigid2(0.2, 0.05, -0.15)}) {
      PlaceBelief belief(field);
      Rigid2 T(1.4, 3.0, heading);
      for (int i = 0; i < 5; ++i) {
        T = Drive(workshop, T, step, 2, &belief);
        EXPECT_FALSE(belief.Believed().has_value()) << heading << " " << i;
      }
    }
  }
}

// Walls of the same size, and other cupboards and benches between them: two of three beams end on mapped surfaces,
// which is enough for no place by the laser alone.
TEST(PlaceBelief, ARoomThatIsHalfAlikeIsNoPlace) {
  FloorPlan mapped, other;
  mapped.Box(0, 0, 10, 6).Box(0, 4.4, 2.2, 6).Box(7.5, 0, 8.2, 1.6);
  other.Box(0, 0, 10, 6).Box(0, 4.4, 2.2, 6).Box(3.2, 4.9, 4.2, 6).Box(3.0, 0, 3.8, 1.2).Box(6.0, 3.0, 7.4, 3.9);
  other.Box(8.6, 2.2, 10, 3.4);
  const auto field = FieldOf(test::Mapped(mapped, {1.0, 0.8}, {9.0, 5.0}));
  constexpr double kLeast = 0.55, kMost = 0.75;  // mean odds of a point, of the best place
  for (const Rigid2& start : {Rigid2(2.0, 2.6, 0.4), Rigid2(5.0, 2.0, -2.4)}) {
    PlaceBelief belief(field);
    int half_alike = 0;
    Rigid2 T = start;
    for (int i = 0; i < 6; ++i) {
      T = Drive(other, T, Rigid2(0.22, 0.0, 0.1), 2, &belief);
      EXPECT_FALSE(belief.Believed().has_value()) << start.angle << " " << i;
      const double fit = belief.hypotheses().front().fit;
      half_alike += fit > kLeast && fit < kMost ? 1 : 0;
    }
    EXPECT_GE(half_alike, 3);
  }
}

// Two rooms that are the same, and a corridor between their doors, which are at different ends of it.
class TwinRooms : public ::testing::Test {
 protected:
  TwinRooms() {
    FloorPlan room;
    room.Wall(0, 0, 4, 0).Wall(4, 0, 4, 3).Wall(4, 3, 2.4, 3).Wall(1.4, 3, 0, 3).Wall(0, 3, 0, 0).Box(2.8, 0, 4, 0.7);
    plan_.Add(room, Rigid2()).Add(room, Rigid2(6, 0, 0));
    plan_.Wall(-1, 3, 0, 3).Wall(4, 3, 6, 3).Wall(10, 3, 14, 3).Wall(-1, 4.5, 14, 4.5).Wall(-1, 3, -1, 4.5);
    plan_.Wall(14, 3, 14, 4.5).Box(4.4, 4.1, 5.4, 4.5);
    sweeps_ = test::Mapped(plan_, {0.6, 0.6}, {3.4, 2.4});
    for (const PosedSweep& more : test::Mapped(plan_, {6.6, 0.6}, {9.4, 2.4})) sweeps_.push_back(more);
    for (const PosedSweep& more : test::Mapped(plan_, {-0.2, 3.7}, {13.0, 3.8})) sweeps_.push_back(more);
  }
  FloorPlan plan_;
  std::vector<PosedSweep> sweeps_;
};

TEST_F(TwinRooms, AreNotBelievedUntilToldApart) {
  PlaceBelief belief(FieldOf(sweeps_));
  Rigid2 T = Drive(plan_, Rigid2(7.9, 0.7, M_PI_2), Rigid2(0.25, 0.0, 0.0), 5, &belief);
  EXPECT_FALSE(belief.Believed().has_value()) << "it may be in either";
  ASSERT_GE(belief.hypotheses().size(), 2U);
  for (int i = 0; i < 18 && !belief.Believed().has_value(); ++i) {  // out of the door, and along the corridor
    const Rigid2 step = T.translation.y() < 3.6 ? Rigid2(0.25, 0.0, 0.0) : Rigid2(0.2, 0.0, T.angle > 0.1 ? -0.5 : 0.0);
    T = T * step;
    belief.Move(step);
    belief.AddSweep(plan_.Sweep(T), FloorPlan::T_base_laser(), Rigid2());
  }
  ExpectAt(belief.Believed(), T);
}

TEST_F(TwinRooms, AreToldApartBySight) {
  PlaceBelief belief(FieldOf(sweeps_));
  Rigid2 T = Drive(plan_, Rigid2(7.9, 0.7, M_PI_2), Rigid2(0.25, 0.0, 0.0), 3, &belief);
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(belief.WantsView());
    belief.AddView({{T, 5.0}});
    EXPECT_FALSE(belief.WantsView()) << "the same view again is no evidence";
    T = T * kStep;
    belief.Move(kStep);
  }
  ExpectAt(belief.Believed(), T);
}

TEST_F(TwinRooms, ViewsOfTheSameThingsRepeatWhatTheyTell) {
  PlaceBelief belief(FieldOf(sweeps_));
  const Rigid2 step(0.2, 0.0, 0.0);
  Rigid2 T = Drive(plan_, Rigid2(7.9, 0.7, M_PI_2), step, 2, &belief);
  double first = 0.0, last = 0.0;
  for (int i = 0; i < 6; ++i) {
    belief.AddView({{T, 1.0}});
    for (const PlaceHypothesis& hypothesis : belief.hypotheses()) {
      if (IsSamePlace(hypothesis.T_map_base, T)) last = hypothesis.sight();
    }
    if (i == 0) first = last;
    T = T * step;
    belief.Move(step);
  }
  EXPECT_DOUBLE_EQ(first, 1.0);
  EXPECT_NEAR(last, 2.0, 1e-9) << "six in a row tell as much as two from different places";
}

TEST_F(TwinRooms, ViewsThatShowedNothingAreViewsToo) {
  PlaceBelief belief(FieldOf(sweeps_));
  const Rigid2 step(0.2, 0.0, 0.0);
  Rigid2 T = Drive(plan_, Rigid2(7.9, 0.7, M_PI_2), step, 2, &belief);
  constexpr int kViews = 6;
  for (int i = 1; i <= kViews; ++i) {
    belief.AddView({{T, i == kViews ? 3.0 : 0.0}});
    if (i == kViews) break;
    T = T * step;
    belief.Move(step);
    belief.AddSweep(plan_.Sweep(T), FloorPlan::T_base_laser(), Rigid2());
  }
  const auto at_robot = std::find_if(belief.hypotheses().begin(), belief.hypotheses().end(),
                                     [&T](const PlaceHypothesis& h) { return IsSamePlace(h.T_map_base, T); });
  ASSERT_NE(at_robot, belief.hypotheses().end());
  EXPECT_EQ(at_robot->views, kViews);
  EXPECT_NEAR(at_robot->sight(), 3.0 / kViews * (1.0 + PlaceHypothesis::kNewInView * (kViews - 1)), 1e-9);
}

TEST(PlaceBelief, IsNotConvincedBySightWithoutTheLaser) {
  PlaceBelief belief(nullptr);
  Rigid2 T(1.0, 2.0, 0.5);
  for (int i = 0; i < 20; ++i) {
    belief.AddView({{T, 5.0}});
    T = T * kStep;
    belief.Move(kStep);
    EXPECT_FALSE(belief.Believed().has_value());
  }
}

TEST(PlaceBelief, GivesUpAPlaceThatTheRobotWasCarriedAwayFrom) {
  PlaceBelief belief(FieldOf(test::MappedOffice()));
  Drive(test::Office(), Rigid2(1.0, 1.0, 0.3), kStep, 4, &belief);
  ASSERT_TRUE(belief.Believed().has_value());
  belief.Move(kStep);
  const Rigid2 truth = Drive(test::Office(), Rigid2(4.7, 2.3, 2.8), Rigid2(0.22, 0.0, 0.02), 12, &belief);
  if (belief.Believed().has_value()) ExpectAt(belief.Believed(), truth);
  EXPECT_TRUE(belief.Contradicts(Rigid2(1.0, 1.0, 0.3)));
}

}  // namespace
}  // namespace planar_vslam
