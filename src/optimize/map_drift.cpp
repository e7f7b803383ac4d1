#include "planar_vslam/optimize/map_drift.h"

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <utility>

#include "tie_information.h"

namespace planar_vslam {

// Which keyframes are settled, and what they say of those at their border.
class MapDrift::Settled {
 public:
  Settled(const Map& map, const MapTies& ties, const MapTies::Changes& changes, const SystematicErrors& systematic);

  // Whether all that has changed is beyond the border.
  bool Stands(const Map& map, const MapTies& ties, const MapTies::Changes& changes) const;
  Eigen::Matrix3d CovarianceOfNewest(const Map& map, const MapTies& ties) const;

 private:
  enum Part : char { kActive, kBorder, kSettled };

  Part PartOf(KeyframeId id) const { return id.value < parts_.size() ? parts_[id.value] : kActive; }
  // The keyframes at the border, and the active ones.
  std::vector<KeyframeId> Rest(const Map& map) const;
  void ChooseActive(const Map& map, const MapTies& ties, const MapTies::Changes& changes);
  std::vector<KeyframeId> Ordered(const Map& map, const MapTies& ties) const;
  void Eliminate(const Map& map, const MapTies& ties, const SystematicErrors& systematic);

  KeyframeId first_;                // the map's first keyframe
  std::vector<Part> parts_;         // by id; later keyframes are active
  std::vector<KeyframeId> active_;  // of those that were there
  std::vector<KeyframeId> border_;  // ascending
  Eigen::MatrixXd information_;     // H_b': three rows a keyframe of the border, one a systematic error
};

namespace {

constexpr std::size_t kAround = 100;      // keyframes: the robot takes a while to leave them
constexpr std::size_t kMostActive = 600;  // keyframes: beyond, it is time to settle some

// Where the three unknowns of each keyframe stand.
class Positions {
 public:
  Positions(const Map& map, const std::vector<KeyframeId>& keyframes) : at_(map.next_keyframe_id, -1) {
    for (const KeyframeId id : keyframes) at_[id.value] = std::exchange(next_, next_ + 3);
  }
  bool Has(KeyframeId id) const { return at_[id.value] >= 0; }
  Eigen::Index Of(KeyframeId id) const { return at_[id.value]; }
  Eigen::Index systematic() const { return next_; }
  Eigen::Index size() const { return next_ + kSystematicErrors; }

 private:
  std::vector<Eigen::Index> at_;
  Eigen::Index next_ = 0;
};

// Both ways of all ties, in one piece: many small ones would scatter over the memory what is allocated later.
class TiedKeyframes {
 public:
  TiedKeyframes(const Map& map, const MapTies& ties) {
    for (const auto& [id, keyframe] : map.keyframes) {
      for (const MapTie& tie : ties.Of(id)) {
        pairs_.emplace_back(tie.from, tie.to);
        pairs_.emplace_back(tie.to, tie.from);
      }
    }
    std::sort(pairs_.begin(), pairs_.end());
  }
  template <class Function>
  void ForEach(KeyframeId id, const Function& function) const {
    auto it = std::lower_bound(pairs_.begin(), pairs_.end(), std::pair(id, KeyframeId{0}));
    for (; it != pairs_.end() && it->first == id; ++it) function(it->second);
  }

 private:
  std::vector<std::pair<KeyframeId, KeyframeId>> pairs_;
};

void AddTie(const Map& map, const MapTie& tie, const Positions& positions, InformationEntries* entries) {
  const Rigid2 T_map_from = ProjectToPlane(map.keyframes.At(tie.from).T_map_base);
  const Rigid2 T_map_to = ProjectToPlane(map.keyframes.At(tie.to).T_map_base);
  AddTieInformation(tie, T_map_to.Inverse() * T_map_from, positions.Of(tie.from), positions.Of(tie.to),
                    positions.systematic(), entries);
}

void AddPrior(const Map& map, KeyframeId id, const Positions& positions, InformationEntries* entries) {
  AddPosePrior(id == map.keyframes.begin()->first, positions.Of(id), entries);
}

Eigen::SparseMatrix<double> Assembled(Eigen::Index size, const InformationEntries& entries) {
  Eigen::SparseMatrix<double> H(size, size);
  H.setFromTriplets(entries.begin(), entries.end());
  return H;
}

}  // namespace

MapDrift::Settled::Settled(const Map& map, const MapTies& ties, const MapTies::Changes& changes,
                           const SystematicErrors& systematic)
    : first_(map.keyframes.begin()->first) {
  ChooseActive(map, ties, changes);
  Eliminate(map, ties, systematic);
}

// What has changed just now is about to change again, and so are those around it: they stay active.
void MapDrift::Settled::ChooseActive(const Map& map, const MapTies& ties, const MapTies::Changes& changes) {
  parts_.assign(map.next_keyframe_id, kSettled);
  const TiedKeyframes tied(map, ties);
  std::vector<KeyframeId> active;
  const auto activate = [&](KeyframeId id) {
    if (!map.keyframes.Contains(id) || std::exchange(parts_[id.value], kActive) == kActive) return;
    active.push_back(id);
  };
  activate(std::prev(map.keyframes.end())->first);
  if (changes.moved.size() + changes.retied.size() < kMostActive - kAround) {
    for (const KeyframeId id : changes.moved) activate(id);
    for (const KeyframeId id : changes.retied) activate(id);
  }
  const std::size_t enough = active.size() + kAround;
  for (std::size_t k = 0; k < active.size() && active.size() < enough; ++k) {
    tied.ForEach(active[k], activate);
  }
  for (const KeyframeId id : active) {
    bool at_border = false;
    tied.ForEach(id, [&](KeyframeId other) { at_border = at_border || parts_[other.value] == kSettled; });
    (at_border ? border_ : active_).push_back(id);
  }
  std::sort(active_.begin(), active_.end());
  std::sort(border_.begin(), border_.end());
  for (const KeyframeId id : border_) parts_[id.value] = kBorder;
}

// The settled keyframes in an order that keeps the factor of H sparse, and then the border.
std::vector<KeyframeId> MapDrift::Settled::Ordered(const Map& map, const MapTies& ties) const {
  std::vector<KeyframeId> settled;
  std::vector<int> index(map.next_keyframe_id, -1);
  for (const auto& [id, keyframe] : map.keyframes) {
    if (parts_[id.value] != kSettled) continue;
    index[id.value] = static_cast<int>(settled.size());
    settled.push_back(id);
  }
  if (settled.empty()) return border_;
  InformationEntries pattern;
  for (const KeyframeId id : settled) {
    pattern.emplace_back(index[id.value], index[id.value], 1.0);
    for (const MapTie& tie : ties.Of(id)) {
      if (parts_[tie.from.value] == kSettled) pattern.emplace_back(index[id.value], index[tie.from.value], 1.0);
    }
  }
  const Eigen::SparseMatrix<double> H = Assembled(static_cast<Eigen::Index>(settled.size()), pattern);
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> old_of_new;
  Eigen::AMDOrdering<int>()(H.selfadjointView<Eigen::Lower>(), old_of_new);
  std::vector<KeyframeId> ordered;
  for (std::size_t k = 0; k < settled.size(); ++k) {
    ordered.push_back(settled[static_cast<std::size_t>(old_of_new.indices()[static_cast<Eigen::Index>(k)])]);
  }
  ordered.insert(ordered.end(), border_.begin(), border_.end());
  return ordered;
}

void MapDrift::Settled::Eliminate(const Map& map, const MapTies& ties, const SystematicErrors& systematic) {
  const std::vector<KeyframeId> ordered = Ordered(map, ties);
  const Positions positions(map, ordered);
  InformationEntries entries;
  for (const auto& [id, keyframe] : map.keyframes) {
    for (const MapTie& tie : ties.Of(id)) {
      if (parts_[tie.from.value] == kSettled || parts_[id.value] == kSettled) AddTie(map, tie, positions, &entries);
    }
  }
  for (const KeyframeId id : ordered) AddPrior(map, id, positions, &entries);
  AddSystematicPrior(systematic, positions.systematic(), &entries);
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::NaturalOrdering<int>> factor(
      Assembled(positions.size(), entries));
  // The last rows of the factor are that of what is left once the rows before are eliminated.
  const Eigen::Index left = 3 * static_cast<Eigen::Index>(border_.size()) + kSystematicErrors;
  const Eigen::SparseMatrix<double> L = factor.matrixL();
  const Eigen::MatrixXd L_left = Eigen::MatrixXd(L.bottomRightCorner(left, left));
  information_ = L_left * factor.vectorD().tail(left).asDiagonal() * L_left.transpose();
}

std::vector<KeyframeId> MapDrift::Settled::Rest(const Map& map) const {
  std::vector<KeyframeId> rest = border_;
  for (const KeyframeId id : active_) {
    if (map.keyframes.Contains(id)) rest.push_back(id);
  }
  for (auto it = map.keyframes.From(KeyframeId{static_cast<std::uint32_t>(parts_.size())}); it != map.keyframes.end();
       ++it) {
    rest.push_back(it->first);
  }
  return rest;
}

bool MapDrift::Settled::Stands(const Map& map, const MapTies& ties, const MapTies::Changes& changes) const {
  const auto is_active = [this](KeyframeId id) { return PartOf(id) == kActive; };
  const auto is_tied_beyond = [&](KeyframeId id) {
    const std::vector<MapTie>& of = ties.Of(id);
    return std::any_of(of.begin(), of.end(), [this](const MapTie& tie) { return PartOf(tie.from) == kSettled; });
  };
  return map.keyframes.begin()->first == first_ && Rest(map).size() <= kMostActive &&
         std::all_of(changes.moved.begin(), changes.moved.end(), is_active) &&
         std::all_of(changes.erased.begin(), changes.erased.end(), is_active) &&
         std::all_of(changes.retied.begin(), changes.retied.end(), is_active) &&
         std::none_of(changes.retied.begin(), changes.retied.end(), is_tied_beyond);
}

Eigen::Matrix3d MapDrift::Settled::CovarianceOfNewest(const Map& map, const MapTies& ties) const {
  const std::vector<KeyframeId> rest = Rest(map);
  const Positions positions(map, rest);
  InformationEntries entries;
  for (const KeyframeId id : rest) {
    for (const MapTie& tie : ties.Of(id)) {
      if (positions.Has(tie.from)) AddTie(map, tie, positions, &entries);
    }
    if (PartOf(id) == kActive) AddPrior(map, id, positions, &entries);
  }
  const Eigen::Index at_border = 3 * static_cast<Eigen::Index>(border_.size());
  const auto position = [&](Eigen::Index k) { return k < at_border ? k : positions.systematic() + k - at_border; };
  for (Eigen::Index r = 0; r < information_.rows(); ++r) {
    for (Eigen::Index c = 0; c <= r; ++c) {
      entries.emplace_back(position(r), position(c), information_(r, c));
    }
  }
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(Assembled(positions.size(), entries));
  const Eigen::Index newest = positions.Of(std::prev(map.keyframes.end())->first);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(positions.size(), 3);
  right.middleRows<3>(newest).setIdentity();
  const Eigen::Matrix3d covariance = solver.solve(right).middleRows<3>(newest);
  return 0.5 * (covariance + covariance.transpose());
}

MapDrift::MapDrift(const MeasurementModel& context, const SystematicErrors& systematic)
    : systematic_(systematic), ties_(context) {}
MapDrift::~MapDrift() = default;

void MapDrift::Follow(const Map& map) {
  const MapTies::Changes changes = ties_.Follow(map);
  map_ = map;
  covariance_.reset();
  if (map.keyframes.size() <= kWhole) {
    settled_.reset();
  } else if (settled_ == nullptr || !settled_->Stands(map, ties_, changes)) {
    settled_ = std::make_unique<Settled>(map, ties_, changes, systematic_);
  }
}

Eigen::Matrix3d MapDrift::CovarianceOfNewest() const {
  if (!covariance_.has_value()) {
    covariance_ = settled_ != nullptr ? settled_->CovarianceOfNewest(map_, ties_)
                                      : Uncertainty().CovarianceOf(std::prev(map_.keyframes.end())->first);
  }
  return *covariance_;
}

MapUncertainty MapDrift::Uncertainty() const { return MapUncertainty(map_, ties_.All(), systematic_); }

}  // namespace planar_vslam
