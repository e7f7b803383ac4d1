#pragma once
// The findings by what they are about; each adds what it finds.
#include <vector>

#include "planar_vslam/pipeline/findings.h"

namespace planar_vslam {

using Found = std::vector<Finding>;

constexpr long kFewestKeyframes = 10;  // that say something

// Wheels and clocks against the images.
void AddClocks(const FindingsInput& in, Found* found);
void AddLaserClock(const FindingsInput& in, Found* found);
void AddMount(const FindingsInput& in, Found* found);
void AddNoMap(const FindingsInput& in, Found* found);
void AddWheels(const FindingsInput& in, Found* found);
// The camera's yaw, where it is known; after all that could bend it.
void AddYaw(const FindingsInput& in, Found* found);
// The camera's height against the floor that the images show: whether it is wrong.
bool AddHeight(const FindingsInput& in, Found* found);

// Share of the keyframes that stand off the floor; 0 of a few.
double OffFloor(const Map* map);
long FramesIn(const EstimatorReport& report, TrackingState state);
// Whether the wheels gave most of the poses.
bool IsBlind(const EstimatorReport& report);

}  // namespace planar_vslam
