#pragma once
// Shared by all tests: where the sample sequences are, a temporary folder, random transforms.
#include <filesystem>
#include <optional>
#include <random>
#include <string>

#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/geometry/rigid3.h"

namespace planar_vslam::test {

// Root of the source tree.
std::filesystem::path SourceFolder();
// The command line's executable planar_vslam.
std::string Executable();

// Folder of one recorded sequence ("dev_lab"), or nothing where the data are not on this machine.
// Looked for in $PLANAR_VSLAM_DATA, then in ../shared/data beside the source tree.
std::optional<std::filesystem::path> SequenceFolder(const std::string& name);

// A folder of its own for a test, removed with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// Uniform rotation over the full circle or sphere, translation within +-`extent` metres.
Rigid2 RandomRigid2(std::mt19937& generator, double extent);
Rigid3 RandomRigid3(std::mt19937& generator, double extent);

}  // namespace planar_vslam::test
