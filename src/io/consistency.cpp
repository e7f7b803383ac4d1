#include "planar_vslam/io/consistency.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "evaluation_pairs.h"
#include "planar_vslam/geometry/chi_square.h"
#include "stamp_text.h"
#include "text_table.h"

namespace planar_vslam {
namespace {

constexpr std::size_t kColumns = 7;

}  // namespace

Expected<std::vector<StampedCovariance>> ReadCovariances(const std::filesystem::path& path) {
  Expected<io::TextTable> table = io::TextTable::Open(path, io::Separator::kComma);
  if (!table.ok()) return table.error();
  std::vector<StampedCovariance> covariances;
  while (table->NextLine()) {
    if (covariances.empty() && table->fields().front() == "t") continue;
    const io::StampText text = io::ParseStamp(table->fields().front());
    const Timestamp stamp = text.stamp;
    std::array<double, 6> v{};
    bool good = text.kind == io::StampText::Kind::kStamp && table->fields().size() == kColumns;
    for (std::size_t k = 0; good && k < v.size(); ++k) {
      v[k] = io::ParseNumber(table->fields()[k + 1]).value_or(std::nan(""));
      good = std::isfinite(v[k]);
    }
    if (!good) return table->ErrorHere("expected t,xx,xy,xh,yy,yh,hh as numbers");
    if (!covariances.empty() && !(covariances.back().stamp < stamp)) return table->ErrorHere("expected ascending t");
    StampedCovariance c{stamp, {}};
    c.covariance << v[0], v[1], v[2], v[1], v[3], v[4], v[2], v[4], v[5];
    if (c.covariance.llt().info() != Eigen::Success) return table->ErrorHere("expected a positive definite matrix");
    covariances.push_back(c);
  }
  return covariances;
}

Expected<bool> WriteCovariances(const std::vector<StampedCovariance>& covariances, const std::filesystem::path& path) {
  std::ofstream file(path, std::ios::binary);
  file << "t,xx,xy,xh,yy,yh,hh\n";
  for (const StampedCovariance& c : covariances) {
    const Eigen::Matrix3d& m = c.covariance;
    file << fmt::format("{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", io::FormatStamp(c.stamp), m(0, 0), m(0, 1),
                        m(0, 2), m(1, 1), m(1, 2), m(2, 2));
  }
  file.close();
  if (!file) return Error{path.string() + ": cannot be written"};
  return true;
}

Expected<Consistency> EvaluateConsistency(const Trajectory& estimate, const std::vector<StampedCovariance>& covariances,
                                          const Trajectory& truth, const std::optional<Rigid3>& T_truth_map) {
  const std::vector<io::PosePair> pairs = io::PairByStamp(estimate, truth);
  if (pairs.empty()) return Error{"no pose has truth around its stamp"};
  const Rigid3 T_map_world =
      (T_truth_map.has_value() ? *T_truth_map : pairs.front().truth * pairs.front().estimate.Inverse()).Inverse();
  Consistency result;
  auto next = covariances.begin();
  for (const io::PosePair& pair : pairs) {
    next = std::lower_bound(next, covariances.end(), pair.stamp,
                            [](const StampedCovariance& c, Timestamp stamp) { return c.stamp < stamp; });
    if (next == covariances.end() || next->stamp != pair.stamp) {
      return Error{"the pose at " + io::FormatStamp(pair.stamp) + " s has no covariance"};
    }
    if (!T_truth_map.has_value() && &pair == &pairs.front()) continue;  // it is right by definition
    const Rigid3 T_map_truth = T_map_world * pair.truth;
    const Eigen::Vector3d e = LogSe2(ProjectToPlane(pair.estimate).Inverse() * ProjectToPlane(T_map_truth));
    const double nees = e.dot(next->covariance.llt().solve(e));
    result.mean_nees += nees;
    result.within_95 += nees < kChi2ThreeDof95 ? 1.0 : 0.0;
    ++result.poses;
  }
  if (result.poses == 0) return Error{"expected at least two poses with truth"};
  result.mean_nees /= static_cast<double>(result.poses);
  result.within_95 /= static_cast<double>(result.poses);
  return result;
}

}  // namespace planar_vslam
