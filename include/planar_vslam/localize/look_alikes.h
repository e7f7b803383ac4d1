#pragma once
// What a map shows elsewhere of what it shows at one of its places: rows of equal benches, aisles that look alike.
#include <memory>
#include <optional>
#include <vector>

#include "planar_vslam/localize/sight_match.h"

namespace planar_vslam {

// The largest share of what the map saw around `T_map_base` that it shows at another place, too. `views` say where it
// is asked. Nothing where the map has never looked from there.
std::optional<double> LookAlikeShare(const LandmarkTable& table, const Map& map, const Rigid2& T_map_base,
                                     const std::vector<SightView>& views);

// A map to be searched by images. An answer about look-alikes is made when it is asked for first, by one thread, and
// counts for a metre around; the rest never changes, and any thread may read it.
class SightMap {
 public:
  explicit SightMap(std::shared_ptr<const Map> map) : map_(std::move(map)), table_(*map_) {}

  const Map& map() const { return *map_; }
  const LandmarkTable& table() const { return table_; }
  std::optional<double> LookAlikeShareAt(const Rigid2& T_map_base, const std::vector<SightView>& views);

 private:
  struct Answer {
    Rigid2 T_map_base;
    std::size_t views = 0;  // that it was asked with: few show less than many
    std::optional<double> share;
  };

  std::shared_ptr<const Map> map_;
  LandmarkTable table_;
  std::vector<Answer> answers_;
};

}  // namespace planar_vslam
