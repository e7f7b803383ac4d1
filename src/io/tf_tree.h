#pragma once
// The tf tree of a recording, offline: every edge over its whole time, so a lookup interpolates and never waits.
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "planar_vslam/io/message_values.h"
#include "planar_vslam/sensor/buffers.h"

namespace planar_vslam::io {

// How to walk from one frame to another: up to their common ancestor, then down. Frames stand for the edge to their
// parent.
struct TfChain {
  std::vector<std::string> up;
  std::vector<std::string> down;
};

enum class TfPush { kAccepted, kNotIncreasing, kNotFinite, kSecondParent };

class TfTree {
 public:
  // A static edge wins over samples of the same edge. The first parent of a frame is its only one.
  TfPush Add(const std::string& parent, const std::string& child, Timestamp stamp, const Rigid3& T_parent_child,
             bool is_static);
  // From now on only the edges of these chains are kept.
  void KeepOnly(const std::vector<TfChain>& chains);

  // Way from `from` to `to`; nothing when they are not connected. The same frame twice is an empty chain.
  std::optional<TfChain> Chain(const std::string& from, const std::string& to) const;
  // T_from_to at `stamp`; nothing when an edge has no samples around it.
  std::optional<Rigid3> At(const TfChain& chain, Timestamp stamp) const;
  // First edge of the chain that moves, as (parent, child).
  std::optional<std::pair<std::string, std::string>> FirstMovingEdge(const TfChain& chain) const;

  bool empty() const { return edges_.empty(); }
  // Every frame ever seen, sorted.
  std::vector<std::string> Frames() const { return {frames_.begin(), frames_.end()}; }

 private:
  struct Edge {
    std::string parent;
    TransformBuffer T_parent_child;
  };
  std::vector<std::string> PathToRoot(const std::string& frame) const;

  std::map<std::string, Edge> edges_;  // by child
  std::set<std::string> frames_;
  bool only_kept_edges_ = false;
};

}  // namespace planar_vslam::io
