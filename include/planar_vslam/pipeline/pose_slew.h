#pragma once
// The pose as it is published while localising. Whoever steers by it sees what odometry leads to and at most 2 cm and 1
// degree of correction in 50 ms; what is still owed of a correction is part of the covariance meanwhile. A correction
// that would take longer than half a second is one jump instead, which its owner declares.
#include <optional>

#include "planar_vslam/geometry/rigid3.h"
#include "planar_vslam/planar/preintegration.h"

namespace planar_vslam {

class PoseSlew {
 public:
  struct Pose {
    Rigid3 T_map_base;
    Matrix6d covariance = Matrix6d::Zero();  // of a right perturbation [translation, rotation]
  };
  struct Published : Pose {
    bool jumped = false;
  };

  // The pose to publish where the best one known is `estimate`. `step`: by odometry since the pose before; nothing, as
  // before the first one, publishes the estimate as it is.
  Published Publish(const Pose& estimate, const std::optional<Rigid2>& step, Timestamp stamp);
  // The next pose has nothing to do with the one before, and is no jump.
  void Forget() { last_.reset(); }

 private:
  struct Last {
    Rigid2 T_map_base;
    Timestamp stamp;
  };

  std::optional<Last> last_;
};

}  // namespace planar_vslam
