#include "support/support.h"

#include <unistd.h>

#include <cstdlib>

namespace planar_vslam::test {

namespace fs = std::filesystem;

fs::path SourceFolder() { return PV_SOURCE_DIR; }

std::string Executable() { return PV_EXECUTABLE; }

std::optional<fs::path> SequenceFolder(const std::string& name) {
  const char* from_environment = std::getenv("PLANAR_VSLAM_DATA");
  const fs::path root = from_environment != nullptr ? fs::path(from_environment) : SourceFolder() / "../shared/data";
  const fs::path folder = root / name;
  if (!fs::is_directory(folder)) return std::nullopt;
  return folder;
}

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (fs::temp_directory_path() / "planar_vslam_XXXXXX").string();
  path_ = mkdtemp(pattern.data());
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

Rigid2 RandomRigid2(std::mt19937& generator, double extent) {
  std::uniform_real_distribution<double> position(-extent, extent), angle(-M_PI, M_PI);
  const double x = position(generator), y = position(generator);
  return Rigid2{Eigen::Vector2d(x, y), angle(generator)};
}

Rigid3 RandomRigid3(std::mt19937& generator, double extent) {
  std::uniform_real_distribution<double> position(-extent, extent);
  std::normal_distribution<double> normal;
  Eigen::Quaterniond q(normal(generator), normal(generator), normal(generator), normal(generator));
  const double x = position(generator), y = position(generator), z = position(generator);
  return Rigid3{q.normalized(), Eigen::Vector3d(x, y, z)};
}

}  // namespace planar_vslam::test
