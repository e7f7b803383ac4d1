#include "bag_transforms.h"

#include <fmt/format.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <vector>

#include "bag_messages.h"

namespace planar_vslam::io {
namespace {

struct FramePair {
  std::string from, to;
};

std::vector<FramePair> WantedPairs(const SensorFrames& frames) {
  std::vector<FramePair> pairs{{frames.base, frames.camera}};
  if (!frames.laser.empty()) pairs.push_back({frames.base, frames.laser});
  if (!frames.odometry_child.empty()) pairs.push_back({frames.odometry_child, frames.base});
  if (!frames.odom.empty()) pairs.push_back({frames.odom, frames.base});
  return pairs;
}

// The chains of all pairs, or nothing while one is not connected yet.
std::optional<std::vector<TfChain>> AllChains(const TfTree& tree, const std::vector<FramePair>& pairs) {
  std::vector<TfChain> chains;
  for (const FramePair& pair : pairs) {
    std::optional<TfChain> chain = tree.Chain(pair.from, pair.to);
    if (!chain.has_value()) return std::nullopt;
    chains.push_back(std::move(*chain));
  }
  return chains;
}

void CountRefused(TfPush result, const geometry_msgs::TransformStamped& transform, SkipLog* skipped) {
  const std::string where = fmt::format("{} -> {} at {}.{:09d}", transform.header.frame_id, transform.child_frame_id,
                                        transform.header.stamp.sec, transform.header.stamp.nsec);
  if (result == TfPush::kNotFinite) skipped->Count("tf not a rigid transform", where);
  if (result == TfPush::kSecondParent) skipped->Count("tf with a second parent", where);
}

// Robots publish dozens of joints: once all wanted frames are connected, only the edges between them are kept.
TfTree ReadTree(const Bags& bags, const BagTopics& topics, const std::vector<FramePair>& wanted, SkipLog* skipped) {
  TfTree tree;
  if (topics.tf.empty()) return tree;
  bool reduced = false;
  ForEachMessage(bags, topics.tf, [&](const StoredMessage& message) {
    const bool is_static = IsStaticTf(message.topic());
    const auto tf = message.ReadIfWhole<tf2_msgs::TFMessage>();
    if (tf == nullptr) {
      skipped->Count("message cut short", message.topic());
      return true;
    }
    for (const geometry_msgs::TransformStamped& transform : tf->transforms) {
      const TfPush result = tree.Add(FrameName(transform.header.frame_id), FrameName(transform.child_frame_id),
                                     ToTimestamp(transform.header.stamp), ToRigid3(transform.transform), is_static);
      CountRefused(result, transform, skipped);
    }
    const auto chains = reduced ? std::nullopt : AllChains(tree, wanted);
    if (chains.has_value()) {
      tree.KeepOnly(*chains);
      reduced = true;
    }
    return true;
  });
  tree.Sort();
  return tree;
}

// The only frame of tf that is `frame` behind a prefix (tf_prefix), where tf does not know `frame` itself.
std::optional<std::string> Prefixed(const std::vector<std::string>& known, const std::string& frame) {
  if (frame.empty() || std::find(known.begin(), known.end(), frame) != known.end()) return std::nullopt;
  const std::string end = "/" + frame;
  std::optional<std::string> found;
  for (const std::string& name : known) {
    if (name.size() <= end.size() || name.compare(name.size() - end.size(), end.size(), end) != 0) continue;
    if (found.has_value()) return std::nullopt;
    found = name;
  }
  return found;
}

void TakePrefixes(const TfTree& tree, SensorFrames* frames, std::vector<std::string>* notes) {
  const std::vector<std::string> known = tree.Frames();
  for (std::string* frame : {&frames->base, &frames->odom, &frames->camera, &frames->laser, &frames->odometry_child}) {
    const std::optional<std::string> prefixed = Prefixed(known, *frame);
    if (!prefixed.has_value()) continue;
    const std::string note = fmt::format("tf frame '{}' is called '{}' here", *frame, *prefixed);
    if (std::find(notes->begin(), notes->end(), note) == notes->end()) notes->push_back(note);
    *frame = *prefixed;
  }
}

// What a base is called where the floor below it has no frame.
std::string BaseInstead(const std::vector<std::string>& known, const std::string& missing, const std::string& base) {
  const char* const other = "base_link";
  if (missing != base || std::find(known.begin(), known.end(), other) == known.end()) return "";
  return fmt::format("; if '{}' is on the floor, --set topics.base_frame={}", other, other);
}

Expected<TfChain> RequiredChain(const TfTree& tree, const std::string& file, const FramePair& pair, const char* what,
                                const std::string& base) {
  if (auto chain = tree.Chain(pair.from, pair.to)) return *chain;
  if (pair.to.empty()) return Error{fmt::format("{}: header.frame_id is empty ({}); expected a tf frame", file, what)};
  const std::vector<std::string> known = tree.Frames();
  for (const std::string& frame : {pair.from, pair.to}) {
    if (std::find(known.begin(), known.end(), frame) != known.end()) continue;
    return Error{fmt::format("{}: tf frame '{}' ({}) is not in this bag; it has {}{}", file, frame, what,
                             fmt::join(known, ", "), BaseInstead(known, frame, base))};
  }
  std::string parents;
  for (const auto& [child, parent] : tree.second_parents()) {
    parents += fmt::format("; '{}' has a second parent in tf, '{}': stop one of its publishers", child, parent);
  }
  return Error{fmt::format("{}: tf does not connect '{}' and '{}' ({}); it has {}{}", file, pair.from, pair.to, what,
                           fmt::join(known, ", "), parents)};
}

}  // namespace

Expected<BagTransforms> ReadTransforms(const Bags& bags, const std::string& file, const BagTopics& topics,
                                       SensorFrames* frames, SkipLog* skipped) {
  BagTransforms transforms;
  if (frames->base.empty()) return transforms;
  TfTree& tree = transforms.tree;
  tree = ReadTree(bags, topics, WantedPairs(*frames), skipped);
  if (tree.empty()) {
    if (topics.odometry.empty() && topics.scan.empty()) return transforms;
    return Error{fmt::format(
        "{}: no tf; expected '{}' -> '{}', as there is odometry or a laser (topics.base_frame '' ignores those)", file,
        frames->base, frames->camera)};
  }
  transforms.has_base_transform = true;
  TakePrefixes(tree, frames, &transforms.notes);
  const Expected<TfChain> camera =
      RequiredChain(tree, file, {frames->base, frames->camera}, "topics.base_frame to the images' frame", frames->base);
  if (!camera) return camera.error();
  transforms.base_to_camera = *camera;
  if (!frames->laser.empty()) {
    const Expected<TfChain> laser =
        RequiredChain(tree, file, {frames->base, frames->laser}, "topics.base_frame to the scans' frame", frames->base);
    if (!laser) return laser.error();
    transforms.base_to_laser = *laser;
  }
  if (!frames->odometry_child.empty()) {
    const Expected<TfChain> child = RequiredChain(tree, file, {frames->odometry_child, frames->base},
                                                  "the odometry's child_frame_id to topics.base_frame", frames->base);
    if (!child) return child.error();
    transforms.odometry_child_to_base = *child;
  }
  if (!frames->odom.empty()) {
    const std::optional<TfChain> odom = tree.Chain(frames->odom, frames->base);
    if (odom.has_value() && !tree.StampsOfMotion(*odom).empty()) transforms.odom_to_base = odom;
  }
  for (const TfChain* mount :
       {&transforms.base_to_camera, &transforms.base_to_laser, &transforms.odometry_child_to_base}) {
    for (const std::string& child : tree.HoldMounts(*mount)) {
      transforms.notes.push_back(fmt::format("tf of '{}' came once, on /tf: taken as static", child));
    }
  }
  return transforms;
}

}  // namespace planar_vslam::io
