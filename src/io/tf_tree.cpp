#include "tf_tree.h"

#include <algorithm>
#include <cmath>

namespace planar_vslam::io {
namespace {

bool IsTransform(const Rigid3& T) { return T.translation.allFinite() && IsRotation(T.rotation); }

bool AreSame(const Rigid3& a, const Rigid3& b) {
  constexpr double kSame = 1e-9;  // m and rad
  return (a.translation - b.translation).norm() < kSame && a.rotation.angularDistance(b.rotation) < kSame;
}

}  // namespace

TfPush TfTree::Add(const std::string& parent, const std::string& child, Timestamp stamp, const Rigid3& T_parent_child,
                   bool is_static) {
  auto edge = edges_.find(child);
  if (edge == edges_.end()) {
    if (only_kept_edges_) return TfPush::kAccepted;
    if (!IsTransform(T_parent_child)) return TfPush::kNotFinite;
    edge = edges_.emplace(child, Edge{parent, {}, {}}).first;
    frames_.insert(parent);
    frames_.insert(child);
  }
  if (edge->second.parent != parent) {
    second_parents_.emplace(child, parent);
    return TfPush::kSecondParent;
  }
  if (!IsTransform(T_parent_child)) return TfPush::kNotFinite;
  const Rigid3 T(T_parent_child.rotation.normalized(), T_parent_child.translation);
  if (is_static) {
    edge->second.T_parent_child.SetStatic(T);
  } else if (!edge->second.T_parent_child.is_static()) {
    edge->second.samples.push_back({stamp, T});
  }
  return TfPush::kAccepted;
}

void TfTree::Sort() {
  for (auto& [child, edge] : edges_) {
    if (edge.T_parent_child.is_static()) continue;
    std::stable_sort(edge.samples.begin(), edge.samples.end(),
                     [](const Sample& a, const Sample& b) { return a.stamp < b.stamp; });
    for (const Sample& sample : edge.samples) edge.T_parent_child.Push(sample.stamp, sample.T_parent_child);
  }
}

std::vector<std::string> TfTree::HoldMounts(const TfChain& chain) {
  std::vector<std::string> once;
  for (const auto* part : {&chain.up, &chain.down}) {
    for (const std::string& child : *part) {
      Edge& edge = edges_.at(child);
      if (edge.T_parent_child.is_static()) continue;
      const Rigid3& first = edge.samples.front().T_parent_child;
      const bool still = std::all_of(edge.samples.begin(), edge.samples.end(),
                                     [&first](const Sample& sample) { return AreSame(sample.T_parent_child, first); });
      if (!still) continue;
      if (edge.samples.size() == 1) once.push_back(child);
      edge.T_parent_child.SetStatic(Rigid3(first));
    }
  }
  return once;
}

void TfTree::KeepOnly(const std::vector<TfChain>& chains) {
  std::map<std::string, Edge> kept;
  for (const TfChain& chain : chains) {
    for (const auto* part : {&chain.up, &chain.down}) {
      for (const std::string& child : *part) {
        auto node = edges_.extract(child);
        if (!node.empty()) kept.insert(std::move(node));
      }
    }
  }
  edges_ = std::move(kept);
  only_kept_edges_ = true;
}

std::vector<std::string> TfTree::PathToRoot(const std::string& frame) const {
  std::vector<std::string> path{frame};
  // A loop in broken data ends when every edge has been walked once.
  while (path.size() <= edges_.size()) {
    const auto edge = edges_.find(path.back());
    if (edge == edges_.end()) break;
    path.push_back(edge->second.parent);
  }
  return path;
}

std::optional<TfChain> TfTree::Chain(const std::string& from, const std::string& to) const {
  const std::vector<std::string> from_path = PathToRoot(from);
  const std::vector<std::string> to_path = PathToRoot(to);
  for (std::size_t i = 0; i < from_path.size(); ++i) {
    const auto common = std::find(to_path.begin(), to_path.end(), from_path[i]);
    if (common == to_path.end()) continue;
    TfChain chain;
    chain.up.assign(from_path.begin(), from_path.begin() + static_cast<std::ptrdiff_t>(i));
    chain.down.assign(to_path.begin(), common);
    std::reverse(chain.down.begin(), chain.down.end());
    return chain;
  }
  return std::nullopt;
}

std::optional<Rigid3> TfTree::At(const TfChain& chain, Timestamp stamp) const {
  Rigid3 T_from_to;
  for (const std::string& child : chain.up) {
    const std::optional<Rigid3> T_parent_child = edges_.at(child).T_parent_child.At(stamp);
    if (!T_parent_child.has_value()) return std::nullopt;
    T_from_to = T_from_to * T_parent_child->Inverse();
  }
  for (const std::string& child : chain.down) {
    const std::optional<Rigid3> T_parent_child = edges_.at(child).T_parent_child.At(stamp);
    if (!T_parent_child.has_value()) return std::nullopt;
    T_from_to = T_from_to * *T_parent_child;
  }
  return T_from_to;
}

std::vector<Timestamp> TfTree::StampsOfMotion(const TfChain& chain) const {
  for (const auto* part : {&chain.up, &chain.down}) {
    for (const std::string& child : *part) {
      const Edge& edge = edges_.at(child);
      if (edge.T_parent_child.is_static()) continue;
      std::vector<Timestamp> stamps;
      for (const Sample& sample : edge.samples) {
        if (stamps.empty() || stamps.back() < sample.stamp) stamps.push_back(sample.stamp);
      }
      return stamps;
    }
  }
  return {};
}

std::string FrameName(const std::string& frame_id) {
  return !frame_id.empty() && frame_id.front() == '/' ? frame_id.substr(1) : frame_id;
}

}  // namespace planar_vslam::io
