#pragma once
// Small worlds whose measurements can be worked out by hand.
#include <string>

#include "planar_vslam/sim/world.h"

namespace planar_vslam::test {

// A bare bright room of 6 x 5 x 2.7 m, no noise anywhere.
inline World BareRoom() {
  World world;
  world.room.floor = {"plain", 120};
  world.room.walls = {"plain", 210};
  world.room.ceiling = {"plain", 200};
  world.room.skirting = 0.0;
  world.lamps.push_back({{3.0, 2.5}, {0.6, 0.6}, 1.0});
  world.drive.start = Rigid2(1.5, 1.5, 0.0);
  world.drive.waypoints = {{4.5, 1.5}, {4.5, 3.5}};
  return world;
}

// Few textures to draw and a short drive with everything in it: for runs through the whole simulation.
inline std::string SmallWorldYaml() {
  return "room: {size: [5, 4, 2.5], floor: {style: plain, shade: 120}, walls: {style: plain}, ceiling: {style: "
         "plain}}\n"
         "lamps: [{at: [2.5, 2]}]\n"
         "objects:\n"
         "  - {kind: box, at: [4.2, 3.2], size: [0.4, 0.4], height: 1.0, texture: shapes}\n"
         "  - {kind: table, at: [2.5, 3.4], size: [1.2, 0.6], texture: {style: plain, shade: 90}}\n"
         "posters: [{wall: east, along: 1.5, size: [0.8, 0.8], texture: text}]\n"
         "drive: {start: [1, 1, 0], shuffle: 0.2, waypoints: [[3, 1.2]]}\n"
         "camera: {size: [160, 120], focal: [152, 152], center: [80, 60], noise: 2, shake_deg: 0.15}\n"
         "laser: {noise: 0.01}\n"
         "odometry: {scale: 1.01, yaw_scale: 1.02, translation_noise: 0.004, rotation_noise_deg: 0.3}\n";
}

}  // namespace planar_vslam::test
