#pragma once
// The search for a place by images (sight_belief.h) as jobs beside the tracking: a view is weighed while frames go on,
// and what it tells is carried along by odometry until it is asked for. While one is weighed no other is taken.
#include <future>
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/localize/sight_belief.h"
#include "planar_vslam/pipeline/executor.h"

namespace planar_vslam {

// A map that is made ready to be searched by an earlier job.
using SightMapFuture = std::shared_future<std::shared_ptr<SightMap>>;

class SightSearch {
 public:
  // `executor`, of one thread, makes the map ready, and outlives this.
  SightSearch(SightMapFuture map, Executor* executor)
      : map_(std::move(map)), belief_(std::make_shared<std::optional<SightBelief>>()), executor_(executor) {}

  // The robot moved.
  void Move(const Rigid2& step) { T_view_now_ = T_view_now_ * step; }
  // Whether a view from here would be evidence, and would be weighed.
  bool WantsView() const;
  void AddView(const CameraView& view, std::vector<Rigid2> suggested, const std::optional<SettledPlace>& expected);
  // The place that the last view has made clear, where the robot is now: told once.
  std::optional<SettledPlace> Found();

 private:
  SightMapFuture map_;
  std::shared_ptr<std::optional<SightBelief>> belief_;  // the jobs', from the first one on
  Executor* executor_;
  Rigid2 T_view_now_;  // since the last view
  bool viewed_ = false;
  std::optional<std::future<std::optional<SettledPlace>>> looking_;
};

}  // namespace planar_vslam
