#pragma once
// What navigation may be told: the body, its limits, how it plans, and when it stops.
#include <string>
#include <vector>

#include "planar_vslam/geometry/option_fields.h"

namespace planar_vslam {

// Defaults are for a base of Pepper's size. None was tuned by driving; docs/navigation.md says what they were driven
// with.
struct NavigateOptions {
  // The body: an upright cylinder around the base's axis, which may turn in place wherever it stands.
  double robot_radius = 0.3;    // m
  double safety_margin = 0.03;  // m, kept between body and obstacles while driving
  bool omnidirectional = false;
  // Limits. Speeds suit a Pepper-like base.
  double max_speed = 0.35;                            // m/s
  double max_sideways_speed = 0.15;                   // m/s, omnidirectional only
  double acceleration = 0.4;                          // m/s^2
  double max_turn_rate = DegreesToRadians(46.0);      // rad/s
  double turn_acceleration = DegreesToRadians(86.0);  // rad/s^2
  double reaction_time = 0.3;                         // s
  double slow_clearance = 0.2;                        // m
  // The costmap.
  double inflation_radius = 0.7;  // m
  double inflation_decay = 6.0;   // 1/m
  double inflation_weight = 8.0;
  bool allow_unknown = false;
  double unknown_margin = 0.3;  // m, the body's radius: what nobody has seen is not under the body
  double mark_range = 3.0;      // m
  double mark_lifetime = 30.0;  // s
  // The controller.
  double lookahead = 0.5;                                 // m
  double turn_first = DegreesToRadians(40.0);             // rad
  double goal_tolerance = 0.1;                            // m
  double goal_heading_tolerance = DegreesToRadians(4.0);  // rad
  // Planning again, and recovery.
  double replan_period = 1.0;      // s
  double patience = 4.0;           // s
  double back_off_distance = 0.3;  // m
  // People who walk.
  double person_radius = 0.25;     // m
  double person_margin = 0.1;      // m
  double foresight = 8.0;          // s; 0: nobody is foreseen, people are obstacles
  double trail_lifetime = 120.0;   // s
  double people_patience = 120.0;  // s
  // When the robot has to stand.
  double max_position_deviation = 0.3;                    // m
  double max_heading_deviation = DegreesToRadians(15.0);  // rad
  double max_drive_without_pose = 1.5;                    // m
  double max_drive_unconfirmed = 1.0;                     // m
  double max_transform_age = 1.0;                         // s
  double max_scan_age = 0.5;                              // s
  double hold_limit = 60.0;                               // s
  double stuck_time = 4.0;                                // s

  template <class Self, class Visitor>
  static void Visit(Self& o, Visitor& v) {
    VisitBody(o, v);
    VisitPlanning(o, v);
    VisitPeople(o, v);
    VisitStops(o, v);
  }
  std::vector<std::string> Problems() const { return ProblemsOf(*this); }

 private:
  template <class Self, class Visitor>
  static void VisitBody(Self& o, Visitor& v) {
    v("robot_radius", o.robot_radius, unit::kMeters, bound::Positive(),
      "radius of the upright cylinder the body is in");
    v("safety_margin", o.safety_margin, unit::kMeters, bound::AtLeast(0.0), "kept between body and obstacles");
    v("omnidirectional", o.omnidirectional, "whether the base can drive sideways");
    v("max_speed", o.max_speed, unit::kMeters, bound::Positive(), "speed ahead, m/s");
    v("max_sideways_speed", o.max_sideways_speed, unit::kMeters, bound::Positive(), "speed sideways, m/s");
    v("acceleration", o.acceleration, unit::kMeters, bound::Positive(),
      "m/s^2, speeding up and slowing down; what the base can surely brake with");
    v("max_turn_rate_deg", o.max_turn_rate, unit::kDegrees, bound::Positive(), "degrees a second");
    v("turn_acceleration_deg", o.turn_acceleration, unit::kDegrees, bound::Positive(), "degrees a second squared");
    v("reaction_time", o.reaction_time, unit::kSeconds, bound::AtLeast(0.0), "from a sweep until the base obeys");
    v("slow_clearance", o.slow_clearance, unit::kMeters, bound::Positive(), "closer to an obstacle it drives slower");
  }
  template <class Self, class Visitor>
  static void VisitPlanning(Self& o, Visitor& v) {
    v("inflation_radius", o.inflation_radius, unit::kMeters, bound::AtLeast("robot_radius", o.robot_radius),
      "up to here from an obstacle a way costs more");
    v("inflation_decay", o.inflation_decay, unit::kNone, bound::Positive(), "1/m, how fast that cost falls");
    v("inflation_weight", o.inflation_weight, unit::kNone, bound::AtLeast(0.0),
      "what a metre costs more where the body touches an obstacle");
    v("allow_unknown", o.allow_unknown, "whether unknown space may be driven through");
    v("unknown_margin", o.unknown_margin, unit::kMeters, bound::AtLeast(0.0),
      "distance of the body's axis from unknown space");
    v("mark_range", o.mark_range, unit::kMeters, bound::Positive(), "the laser's obstacles are noted up to here");
    v("mark_lifetime", o.mark_lifetime, unit::kSeconds, bound::Positive(),
      "until an obstacle out of sight is forgotten");
    v("lookahead", o.lookahead, unit::kMeters, bound::Positive(), "the point of the path that is driven to");
    v("turn_first_deg", o.turn_first, unit::kDegrees, bound::Between(0.0, 180.0), "farther off it turns in place");
    v("goal_tolerance", o.goal_tolerance, unit::kMeters, bound::Positive(), "a goal is reached within this distance");
    v("goal_heading_tolerance_deg", o.goal_heading_tolerance, unit::kDegrees, bound::Positive(), "and this heading");
    v("replan_period", o.replan_period, unit::kSeconds, bound::Positive(), "between two plans");
    v("patience", o.patience, unit::kSeconds, bound::AtLeast(0.0), "blocked for so long, recovery starts");
    v("back_off_distance", o.back_off_distance, unit::kMeters, bound::AtLeast(0.0), "how far recovery backs off");
  }
  template <class Self, class Visitor>
  static void VisitPeople(Self& o, Visitor& v) {
    v("person_radius", o.person_radius, unit::kMeters, bound::Positive(), "of somebody who walks");
    v("person_margin", o.person_margin, unit::kMeters, bound::AtLeast(0.0), "kept from where somebody walks to");
    v("foresight", o.foresight, unit::kSeconds, bound::ZeroOr(bound::Between(0.0, 20.0)),
      "so far ahead it expects people who walk; 0: they are obstacles where they are seen");
    v("trail_lifetime", o.trail_lifetime, unit::kSeconds, bound::Positive(), "until it forgets where somebody walked");
    v("people_patience", o.people_patience, unit::kSeconds, bound::AtLeast(0.0),
      "kept from driving on by people for so long, it gives up");
  }
  template <class Self, class Visitor>
  static void VisitStops(Self& o, Visitor& v) {
    v("max_position_deviation", o.max_position_deviation, unit::kMeters, bound::Positive(),
      "a pose with a larger standard deviation is none");
    v("max_heading_deviation_deg", o.max_heading_deviation, unit::kDegrees, bound::Positive(),
      "likewise of the heading");
    v("max_drive_without_pose", o.max_drive_without_pose, unit::kMeters, bound::Positive(),
      "driven without a message on pose until the robot stands");
    v("max_drive_unconfirmed", o.max_drive_unconfirmed, unit::kMeters, bound::Positive(),
      "driven by the wheels alone, by what state says, until the robot stands and looks round");
    v("max_transform_age", o.max_transform_age, unit::kSeconds, bound::Positive(), "of map to base");
    v("max_scan_age", o.max_scan_age, unit::kSeconds, bound::Positive(), "of the laser's last sweep");
    v("hold_limit", o.hold_limit, unit::kSeconds, bound::AtLeast(0.0), "standing for such a reason, then it gives up");
    v("stuck_time", o.stuck_time, unit::kSeconds, bound::Positive(), "told to move without moving, then it gives up");
  }
};

}  // namespace planar_vslam
