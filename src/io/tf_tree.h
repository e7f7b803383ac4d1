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

enum class TfPush { kAccepted, kNotFinite, kSecondParent };

class TfTree {
 public:
  // A static edge wins over samples of the same edge. The first parent of a frame is its only one. Samples come in any
  // order.
  TfPush Add(const std::string& parent, const std::string& child, Timestamp stamp, const Rigid3& T_parent_child,
             bool is_static);
  // From now on only the edges of these chains are kept.
  void KeepOnly(const std::vector<TfChain>& chains);

  // Everything has been added: what follows may be asked. Of samples with one stamp the first counts.
  void Sort();
  // Makes the edges of this way static whose samples are all the same: mounts that are published like joints, also once
  // only, hold before the first and after the last sample. Gives the child frames of those with one sample.
  std::vector<std::string> HoldMounts(const TfChain& chain);

  // Way from `from` to `to`; nothing when they are not connected. The same frame twice is an empty chain.
  std::optional<TfChain> Chain(const std::string& from, const std::string& to) const;
  // T_from_to at `stamp`; nothing when an edge has no samples around it.
  std::optional<Rigid3> At(const TfChain& chain, Timestamp stamp) const;
  // The stamps of the samples of the chain's first edge that moves; none where none does.
  std::vector<Timestamp> StampsOfMotion(const TfChain& chain) const;

  bool empty() const { return edges_.empty(); }
  // Frames that were said to hang on another one, too, and on which.
  const std::map<std::string, std::string>& second_parents() const { return second_parents_; }
  // Every frame ever seen, sorted.
  std::vector<std::string> Frames() const { return {frames_.begin(), frames_.end()}; }

 private:
  struct Sample {
    Timestamp stamp;
    Rigid3 T_parent_child;
  };
  struct Edge {
    std::string parent;
    std::vector<Sample> samples;
    TransformBuffer T_parent_child;  // of the samples, once they are sorted
  };
  std::vector<std::string> PathToRoot(const std::string& frame) const;

  std::map<std::string, Edge> edges_;  // by child
  std::set<std::string> frames_;
  std::map<std::string, std::string> second_parents_;
  bool only_kept_edges_ = false;
};

}  // namespace planar_vslam::io
