#pragma once
// The robot: its sensors, its drive and its mishaps.
#include <optional>

#include "building.h"
#include "planar_vslam/sim/drive.h"

namespace planar_vslam::sim {

// What rendering and mapping a world may cost.
struct Budget {
  double images = 0.0;      // at most
  bool keeps_rate = false;  // the drive is shortened to keep within it, else the camera's rate is lowered
};

// Camera, laser and wheels.
Budget DrawSensors(World* world, Draws& draws);

// A drive that keeps clear of what stands in the building so far, at `fastest` m/s at most. None where no way is found.
std::optional<Drive> DrawDrive(World* world, double fastest, const Budget& budget, Draws& draws);

// The camera's rate, as far as the budget demands, and what depends on it.
void KeepBudget(World* world, const Budget& budget, double duration);

// When the wheels slip, within `duration` seconds.
void DrawSlips(World* world, double duration, Draws& draws);

// Sills in doorways, a ramp in the way, things that stand about and people, all so that the drive stays free.
void AddSills(Building* building, Draws& draws);
void AddRamp(World* world, const Drive& drive, Draws& draws);
void AddClutter(Building* building, const Drive& drive, Draws& draws);
void AddPeople(Building* building, const Drive& drive, Draws& draws);

}  // namespace planar_vslam::sim
