#include "publishers.h"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <fmt/format.h>

#include <algorithm>

#include "converters.h"
#include "planar_vslam/pipeline/findings.h"
#include "planar_vslam/pipeline/navigation_map.h"

namespace planar_vslam::ros_face {
namespace {

// Whether `period` seconds have passed since `last`; takes note if so. A jump back of time counts as passed.
bool IsDue(std::optional<Timestamp>* last, Timestamp now, double period) {
  if (last->has_value() && now > **last && SecondsBetween(**last, now) < period) return false;
  *last = now;
  return true;
}

// The loops closed, by the keyframes that are still there.
std::vector<KeyframePair> LoopsOf(const Map& map, const EstimatorReport& report) {
  std::vector<KeyframePair> loops;
  for (const LoopReport& loop : report.loops) {
    for (const auto& [id, keyframe] : map.keyframes) {
      if (keyframe.stamp == loop.keyframe) loops.emplace_back(loop.closed.old, id);
    }
  }
  return loops;
}

}  // namespace

LocalizationPublisher::LocalizationPublisher(ros::NodeHandle* node, const NodeSettings& settings)
    : settings_(settings),
      pose_(node->advertise<geometry_msgs::PoseWithCovarianceStamped>("pose", 50)),
      transform_tolerance_(settings.transform_tolerance) {
  if (!settings_.publish_tf || !settings_.with_odometry()) return;
  timer_ = node->createTimer(ros::Duration(1.0 / settings_.tf_rate), [this](const ros::TimerEvent&) { Broadcast(); });
}

void LocalizationPublisher::OnFrame(const FrameReport& report) {
  if (!report.T_map_base.has_value()) return;
  // Lengths of unknown scale are no poses to drive by; a lone camera has nothing better.
  if (!report.metric && settings_.with_odometry()) return;
  pose_.publish(
      ToPoseWithCovariance(MakeHeader(report.stamp, settings_.map_frame), *report.T_map_base, report.covariance));
  if (!report.T_map_odom.has_value()) return;
  const std::lock_guard<std::mutex> lock(mutex_);
  T_map_odom_ = report.T_map_odom;
}

void LocalizationPublisher::OnRestart() {
  const std::lock_guard<std::mutex> lock(mutex_);
  T_map_odom_.reset();
}

void LocalizationPublisher::Apply(const RunTimeSettings& settings) {
  timer_.setPeriod(ros::Duration(1.0 / settings.tf_rate));
  const std::lock_guard<std::mutex> lock(mutex_);
  transform_tolerance_ = settings.transform_tolerance;
}

void LocalizationPublisher::OnOdometry(const ros::Time& stamp) {
  const std::lock_guard<std::mutex> lock(mutex_);
  // Stamps of tf only grow. A clock that went back starts anew, sooner here than the tracking thread hears of it.
  if (stamp < odometry_stamp_ && (odometry_stamp_ - stamp).toSec() <= kTimeJumpSeconds) return;
  odometry_stamp_ = stamp;
}

void LocalizationPublisher::Broadcast() {
  Rigid2 T_map_odom;
  ros::Time stamp;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!T_map_odom_.has_value() && !settings_.publish_tf_before_fix) return;
    // tf refuses the same stamp twice.
    if (odometry_stamp_.isZero() || odometry_stamp_ == broadcast_stamp_) return;
    broadcast_stamp_ = odometry_stamp_;
    stamp = odometry_stamp_ + ros::Duration(transform_tolerance_);
    T_map_odom = T_map_odom_.value_or(Rigid2());
  }
  broadcaster_.sendTransform(ToTransform(MakeHeader(ToTimestamp(stamp), settings_.map_frame),
                                         settings_.pipeline.topics.odom_frame, Embed3(T_map_odom)));
}

MapPublisher::MapPublisher(ros::NodeHandle* node, const NodeSettings& settings)
    : settings_(settings),
      run_time_(RunTimeOf(settings)),
      navigation_(settings.pipeline.mapping2d, LandmarkAcceptance::For(settings.pipeline.pixel_sigma),
                  NavigationTolerance::For(settings.pipeline.mapping2d.resolution)),
      map_(node->advertise<nav_msgs::OccupancyGrid>(
          "map", 1, [this](const ros::SingleSubscriberPublisher& subscriber) { OnMapSubscriber(subscriber); })),
      map_updates_(node->advertise<map_msgs::OccupancyGridUpdate>("map_updates", 10)),
      map_points_(node->advertise<sensor_msgs::PointCloud2>("map_points", 1, true)),
      path_(node->advertise<nav_msgs::Path>("path", 1, true)),
      keyframes_(node->advertise<geometry_msgs::PoseArray>("keyframes", 1, true)),
      graph_(node->advertise<visualization_msgs::MarkerArray>("graph", 1)) {
  // Who subscribes is served by the builder, which is there only now.
  octomap_.emplace(node, settings.pipeline.mapping2d.resolution,
                   [this] { builder_.Submit([this] { PublishOctomap(); }); });
}

void MapPublisher::OnFrame(const TrackingLoop& loop, Timestamp stamp) {
  if (building_ || loop.map() == nullptr) return;
  const RunTimeSettings run_time = this->run_time();
  const bool grid_due = loop.map()->metric && IsDue(&last_grid_, stamp, run_time.map_period);
  const bool points_due = IsDue(&last_points_, stamp, run_time.map_points_period);
  if (!grid_due && !points_due) return;
  building_ = true;
  builder_.Submit([this, snapshot = *loop.Snapshot(), loops = LoopsOf(*loop.map(), loop.estimator()->report()),
                   grid_due, generation = generation_] {
    Publish(snapshot, loops, grid_due, generation);
    building_ = false;
  });
}

void MapPublisher::Apply(const RunTimeSettings& settings) {
  const std::lock_guard<std::mutex> lock(run_time_mutex_);
  run_time_ = settings;
}

NodeSettings MapPublisher::settings() const { return With(settings_, run_time()); }

RunTimeSettings MapPublisher::run_time() const {
  const std::lock_guard<std::mutex> lock(run_time_mutex_);
  return run_time_;
}

void MapPublisher::OnRestart() {
  last_grid_.reset();
  last_points_.reset();
  const std::lock_guard<std::mutex> lock(mutex_);
  ++generation_;
  // What is latched or remembered would be taken for the new map's.
  std_msgs::Header header = grid_header_;
  header.frame_id = settings_.map_frame;
  map_points_.publish(ToPointCloud(header, {}));
  path_.publish(ToPath(header, {}));
  keyframes_.publish(ToPoseArray(header, Map{}));
  graph_.publish(ToGraphMarkers(header, Map{}, {}));
  octomap_->Clear(header);
  if (!grid_.has_value()) return;
  OccupancyGrid2d nothing_known = *grid_;
  constexpr std::int8_t kUnknown = -1;
  std::fill(nothing_known.cells.begin(), nothing_known.cells.end(), kUnknown);
  map_.publish(ToOccupancyGrid(grid_header_, nothing_known));
  grid_.reset();
}

void MapPublisher::Publish(const EstimatorSnapshot& snapshot, const std::vector<KeyframePair>& loops, bool grid_due,
                           long generation) {
  const std_msgs::Header header = MakeHeader(snapshot.stamp, settings_.map_frame);
  const sensor_msgs::PointCloud2 points = ToPointCloud(header, LandmarkCloud(*snapshot.map));
  const nav_msgs::Path path = ToPath(header, snapshot.trajectory.Poses(*snapshot.map));
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (generation != generation_) return;
    map_points_.publish(points);
    path_.publish(path);
    keyframes_.publish(ToPoseArray(header, *snapshot.map));
    if (graph_.getNumSubscribers() > 0) graph_.publish(ToGraphMarkers(header, *snapshot.map, loops));
  }
  if (!grid_due) return;
  const RunTimeSettings run_time = this->run_time();
  navigation_.SetBand(run_time.band_min, run_time.band_max);
  navigation_.Update(*snapshot.map, snapshot.camera);
  PublishGrid(header, navigation_.builder().Grid(), generation);
  octomap_header_ = header;
  octomap_generation_ = generation;
  PublishOctomap();
}

void MapPublisher::PublishOctomap() {
  const OctomapTopics::Messages messages = octomap_->Make(octomap_header_, navigation_.builder());
  const std::lock_guard<std::mutex> lock(mutex_);
  if (octomap_generation_ == generation_) octomap_->Publish(messages);
}

void MapPublisher::PublishGrid(const std_msgs::Header& header, const OccupancyGrid2d& grid, long generation) {
  // Also while publishing, so that a new subscriber's map and the updates reach it in order.
  const std::lock_guard<std::mutex> lock(mutex_);
  if (generation != generation_) return;
  if (!grid_.has_value() || !HaveSameLayout(*grid_, grid)) {
    map_.publish(ToOccupancyGrid(header, grid));
  } else if (const std::optional<GridRegion> region = ChangedRegion(*grid_, grid); region.has_value()) {
    map_updates_.publish(ToGridUpdate(header, grid, *region));
  }
  grid_ = grid;
  grid_header_ = header;
}

// A latched map would be the last whole one, without the updates since.
void MapPublisher::OnMapSubscriber(const ros::SingleSubscriberPublisher& subscriber) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (grid_.has_value()) subscriber.publish(ToOccupancyGrid(grid_header_, *grid_));
}

std::optional<nav_msgs::OccupancyGrid> MapPublisher::grid() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!grid_.has_value()) return std::nullopt;
  return ToOccupancyGrid(grid_header_, *grid_);
}

namespace {

// What contradicts what so far. Before there is a metric map, too little is known to say so.
std::vector<std::string> FindingsSoFar(const TrackingLoop& loop) {
  const std::shared_ptr<const Map> map = loop.map();
  if (loop.estimator() == nullptr || map == nullptr || !map->metric) return {};
  const EstimatorReport& report = loop.estimator()->report();
  if (HardlyMapped(report, map.get())) return {};
  FindingsInput input{report, loop.estimator()->input_watch(), map.get(), loop.unused()};
  input.readout = loop.estimator()->settings().options.image_timing.readout;
  input.recorded = false;
  return Findings(input);
}

// One status of its own: its message is the most harmful one, its values are all of them.
diagnostic_msgs::DiagnosticStatus ToStatus(const std::string& name, const std::vector<std::string>& findings) {
  using diagnostic_msgs::DiagnosticStatus;
  DiagnosticStatus status;
  status.name = name + ": findings";
  status.hardware_id = "none";
  status.level = findings.empty() ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
  status.message = findings.empty() ? "none" : findings.front();
  for (const std::string& finding : findings) {
    diagnostic_msgs::KeyValue pair;
    pair.key = std::to_string(status.values.size() + 1);
    pair.value = finding;
    status.values.push_back(pair);
  }
  return status;
}

}  // namespace

DiagnosticsPublisher::DiagnosticsPublisher(ros::NodeHandle* node, const std::string& name, const InputQueue& queue)
    : queue_(queue), name_(name), publisher_(node->advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10)) {
  constexpr double kPeriodSeconds = 1.0;
  timer_ = node->createWallTimer(ros::WallDuration(kPeriodSeconds), [this](const ros::WallTimerEvent&) { Publish(); });
}

void DiagnosticsPublisher::OnFrame(const FrameReport& report) {
  const std::lock_guard<std::mutex> lock(mutex_);
  status_.frame = report;
  status_.stages.Add(report.times);
  ++status_.frames;
}

void DiagnosticsPublisher::OnInput(const TrackingLoop& loop) {
  const std::shared_ptr<const Map> map = loop.map();
  std::map<std::string, long> unused = loop.unused();
  constexpr double kFindingsPeriod = 5.0;  // s: they go through all keyframes
  const ros::WallTime now = ros::WallTime::now();
  std::optional<std::vector<std::string>> findings;
  if ((now - findings_time_).toSec() > kFindingsPeriod) {
    findings_time_ = now;
    findings = FindingsSoFar(loop);
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  status_.waiting_for = loop.waiting_for();
  status_.unused = std::move(unused);
  if (findings.has_value()) status_.findings = std::move(*findings);
  status_.keyframes = map != nullptr ? map->keyframes.size() : 0;
  status_.points = map != nullptr ? map->landmarks.size() : 0;
  if (loop.estimator() == nullptr) return;
  status_.loops = loop.estimator()->report().loops.size();
  status_.failed_adjustments = loop.estimator()->report().failed_adjustments;
}

void DiagnosticsPublisher::Publish() {
  Status status;
  bool stalled = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    status = status_;
    stalled = status_.frames == frames_before_;
    frames_before_ = status_.frames;
  }
  using diagnostic_msgs::DiagnosticStatus;
  DiagnosticStatus message;
  message.name = name_ + ": tracking";
  message.hardware_id = "none";
  const auto add = [&message](const std::string& key, const std::string& value) {
    diagnostic_msgs::KeyValue pair;
    pair.key = key;
    pair.value = value;
    message.values.push_back(pair);
  };
  const TrackingState state = status.frame.has_value() ? status.frame->state : TrackingState::kInitializing;
  // Waiting a moment is normal; a second without a frame is not.
  std::string waiting_for = stalled ? (status.waiting_for.empty() ? "images" : status.waiting_for) : "";
  if (!stalled && state == TrackingState::kInitializing) waiting_for = status.frame->waiting_for;
  const bool well = !stalled && (state == TrackingState::kTracking || state == TrackingState::kRelocalized);
  message.level = well ? DiagnosticStatus::OK : DiagnosticStatus::WARN;
  if (!stalled && state == TrackingState::kLost) message.level = DiagnosticStatus::ERROR;
  message.message =
      waiting_for.empty() ? ToString(state) : fmt::format("{}, waiting for {}", ToString(state), waiting_for);
  add("state", ToString(state));
  add("waiting for", waiting_for);
  if (status.frame.has_value()) {
    add("inliers", std::to_string(status.frame->inliers));
    add("metric", status.frame->metric ? "true" : "false");
    add("frame time (ms)", fmt::format("{:.1f}", status.frame->total_ms));
  }
  add("frames", std::to_string(status.frames));
  add("keyframes", std::to_string(status.keyframes));
  add("points", std::to_string(status.points));
  add("loops closed", std::to_string(status.loops));
  for (const auto& [reason, count] : status.failed_adjustments) add("failed: " + reason, std::to_string(count));
  for (const auto& [stage, times] : status.stages.stages()) {
    add(stage + " p50, p99 (ms)", fmt::format("{:.2f}, {:.2f}", times.Percentile(0.5), times.Percentile(0.99)));
  }
  const std::map<std::string, long> dropped = queue_.dropped();
  add("dropped images", std::to_string(dropped.count("images") != 0 ? dropped.at("images") : 0));
  for (const auto& [kind, count] : dropped) {
    if (kind != "images" && kind != "camera infos") add("dropped " + kind, std::to_string(count));
  }
  for (const auto& [reason, count] : status.unused) add("unused: " + reason, std::to_string(count));
  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = ros::Time::now();
  array.status.push_back(message);
  array.status.push_back(ToStatus(name_, status.findings));
  publisher_.publish(array);
}

}  // namespace planar_vslam::ros_face
