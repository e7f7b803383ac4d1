#pragma once
// A world as the text of a world file.
#include <string>

#include "planar_vslam/sim/world.h"

namespace planar_vslam {

// What ParseWorld reads back as the same world, but for numbers, which have six digits: written, read and written
// again, the text is the same.
std::string WriteWorld(const World& world);

}  // namespace planar_vslam
