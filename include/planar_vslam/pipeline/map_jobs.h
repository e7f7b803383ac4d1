#pragma once
// The jobs that change a map, and the threads they run on. Two of the paper's three parallel activities live here; the
// third is the caller, which tracks and never waits for either:
//   writer    maps keyframes, makes an unscaled map metric, puts corrections into the map; one job at a time
//   searcher  looks for loops and closes them, adjusts the map as a whole: long jobs on a snapshot. What they find is a
//             correction, which the writer puts into the map as it is by then (map_correction.h)
// With the inline schedule each job runs when it is asked for, and the map is never older than its correction.
#include <atomic>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "planar_vslam/backend/look_back.h"
#include "planar_vslam/backend/map_joiner.h"
#include "planar_vslam/backend/map_keyframe.h"
#include "planar_vslam/pipeline/executor.h"
#include "planar_vslam/pipeline/map_change.h"
#include "planar_vslam/pipeline/map_scale.h"

namespace planar_vslam {

struct MapJobsContext {
  MapperContext mapper;
  ScaleOptions scale;
};

// What the wheels read wrong, as far as it is known.
struct LearntWheels {
  KeyframeId first;     // from whose link on the map's links are corrected...
  WheelErrors prior;    // ...what was known before them...
  WheelErrors applied;  // ...and by what they are
};

class MapJobs {
 public:
  // `wheels`: by what the odometry that comes is corrected. `known`: another map, with all ids below, that this one is
  // to become one with; or none.
  MapJobs(const MapJobsContext& context, std::shared_ptr<const Map> map, Schedule schedule, const WheelErrors& wheels,
          std::shared_ptr<const Map> known = nullptr);
  ~MapJobs();
  MapJobs(const MapJobs&) = delete;
  MapJobs& operator=(const MapJobs&) = delete;

  const std::shared_ptr<const Map>& map() const { return map_; }
  // Whether the writer has something to do: no keyframe may come before it is done.
  bool busy() const { return writing_.has_value() || correction_.has_value(); }

  // The writer must not be busy.
  void AddKeyframe(KeyframeProposal proposal);
  // The next keyframe waits for the one at work, which is finished in less detail.
  void Hurry() { hurry_.store(true, std::memory_order_relaxed); }
  // A keyframe that is to come was seen in the known map.
  void Meet(const Meeting& meeting) { meetings_.push_back(meeting); }
  // Multiplies the unscaled map by exp(log_scale); it is adjusted as a whole next.
  void MakeMetric(double log_scale, Timestamp stamp);
  // As soon as the searcher is free.
  void AdjustWholeMap(int max_iterations);
  // The map's images follow as soon as the writer is free (map_edit.h); it is adjusted as a whole next.
  void SetImageOffset(double offset) { image_offset_due_ = offset; }

  // The changes since the last call, in their order; starts what has become due. `wait`: until nothing is left to do.
  std::vector<MapChange> Collect(bool wait);
  // On the caller, when nothing is left to do: an edit, and an adjustment of the whole map. The latter gives the reason
  // where it fails and the map stays.
  void Edit(const MapEdit& edit);
  Expected<MapChange> AdjustNow(int max_iterations);
  // The map's scale with the standard deviation that follows from all of its ties. O(keyframes).
  MapScale FinalScale() const;

 private:
  struct Writing {
    std::future<MapChange> change;
    bool corrects = false;  // puts a correction into the map
  };
  // What the searcher found, on which snapshot.
  struct Found {
    std::shared_ptr<const Map> snapshot, corrected;  // the latter is null where nothing is to be corrected
    std::shared_ptr<const Map> known;                // that has to be put beside the map first; or none
    MapCorrection correction;
    MapChange change;  // but for the map
  };

  bool MayAssessScale();
  std::optional<LearntWheels> MayLearnWheels();
  void Write(std::function<MapChange()> job, bool corrects);
  bool StartDue();
  void Search();
  void Take(Found found, std::vector<MapChange>* changes);
  Found Adjust(const std::shared_ptr<const Map>& snapshot, int max_iterations) const;
  Found LookBackFrom(const std::shared_ptr<const Map>& snapshot);
  bool Join(const std::shared_ptr<const Map>& snapshot, const std::shared_ptr<const Map>& known,
            const std::vector<Meeting>& meetings, Found* found);
  MapChange Correct(const Found& found, const std::shared_ptr<const Map>& now) const;

  const MapJobsContext context_;
  std::shared_ptr<const Map> map_;
  std::shared_ptr<const Map> known_;     // until the map is one with it
  std::vector<Meeting> meetings_;        // with the known map
  std::optional<MapJoiner> joiner_;      // the searcher's
  std::optional<MapDrift> drift_;        // the searcher's
  std::uint32_t scale_assessed_at_ = 0;  // the next keyframe's id, then
  LearntWheels wheels_;
  std::uint32_t wheels_learned_at_;                  // the next keyframe's id, then
  std::vector<std::shared_ptr<const Map>> retired_;  // big maps are taken apart on the writer's thread
  std::optional<Writing> writing_;
  std::optional<std::future<Found>> searching_;
  std::optional<Found> correction_;  // waits for the writer
  std::atomic<bool> hurry_{false};
  bool look_back_due_ = false;                   // a keyframe came that the searcher has not seen
  std::optional<int> adjust_due_;                // the whole map, with at most so many iterations
  std::optional<double> image_offset_due_;       // s
  std::unique_ptr<Executor> searcher_, writer_;  // last: their jobs end before the rest goes
};

}  // namespace planar_vslam
