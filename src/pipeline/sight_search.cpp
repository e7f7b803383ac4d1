#include "planar_vslam/pipeline/sight_search.h"

#include <utility>

namespace planar_vslam {

bool SightSearch::WantsView() const {
  return !looking_.has_value() && (!viewed_ || SightBelief::IsNewPlace(T_view_now_));
}

void SightSearch::AddView(const CameraView& view, std::vector<Rigid2> suggested,
                          const std::optional<SettledPlace>& expected) {
  const auto look = [map = map_, kept = belief_, moved = std::exchange(T_view_now_, Rigid2()), view,
                     suggested = std::move(suggested), expected]() -> std::optional<SettledPlace> {
    if (!kept->has_value()) kept->emplace(map.get());
    SightBelief* belief = &**kept;
    belief->Move(moved);
    belief->AddView(view, suggested, expected);
    if (!belief->Believed().has_value()) return std::nullopt;
    return static_cast<const SettledPlace&>(*belief->Believed());
  };
  viewed_ = true;
  looking_ = Submit(executor_, look);
}

std::optional<SettledPlace> SightSearch::Found() {
  if (!looking_.has_value() || !IsReady(*looking_, false)) return std::nullopt;
  std::optional<SettledPlace> found = looking_->get();
  looking_.reset();
  if (!found.has_value()) return std::nullopt;
  const Eigen::Matrix3d adjoint = AdjointSe2(T_view_now_.Inverse());
  found->T_map_base = found->T_map_base * T_view_now_;
  found->covariance = adjoint * found->covariance * adjoint.transpose();
  return found;
}

}  // namespace planar_vslam
