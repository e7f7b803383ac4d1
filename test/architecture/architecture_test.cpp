// The sources against the rules of ARCHITECTURE.md, and the rules against made-up sources that break them.
#include <gtest/gtest.h>

#include <algorithm>

#include "include_rules.h"
#include "support/support.h"

namespace planar_vslam::test {
namespace {

using Violations = std::vector<std::string>;

const Violations kNone;
const Violations kCodeEndings{".h", ".hpp", ".cpp", ".cc"};

std::vector<SourceFile> ProductSources() {
  return ReadSources(test::SourceFolder(), {"include", "src", "planar", "mapping2d"}, kCodeEndings);
}

std::string Lines(const Violations& violations) {
  std::string text;
  for (const std::string& violation : violations) text += "\n  " + violation;
  return text;
}

TEST(Architecture, EveryModuleIsRead) {
  const std::vector<SourceFile> files = ProductSources();
  for (const std::string header : {"include/planar_vslam/geometry/rigid3.h", "src/map/validate.cpp",
                                   "planar/include/planar_vslam/planar/preintegration.h", "mapping2d/src/grid.cpp"}) {
    EXPECT_TRUE(std::any_of(files.begin(), files.end(), [&header](const SourceFile& f) { return f.path == header; }))
        << header;
  }
}

TEST(Architecture, IncludesFollowTheModuleGraph) {
  const Violations violations = ModuleViolations(ProductSources());
  EXPECT_EQ(violations, kNone) << Lines(violations);
}

TEST(Architecture, RosAndPclStayAtTheRim) {
  const Violations violations = RimViolations(ProductSources());
  EXPECT_EQ(violations, kNone) << Lines(violations);
}

TEST(Architecture, HeadersDoNotIncludeEachOther) {
  const Violations violations = CycleViolations(ProductSources());
  EXPECT_EQ(violations, kNone) << Lines(violations);
}

TEST(Architecture, FilesCanBeReadInOneSitting) {
  const Violations violations = LengthViolations(ReadSources(
      test::SourceFolder(), {"include", "src", "planar", "mapping2d", "test", "bench", "examples"}, kCodeEndings));
  EXPECT_EQ(violations, kNone) << Lines(violations);
}

TEST(Architecture, CompilerFlagsArePortable) {
  const Violations violations = FlagViolations(ReadSources(
      test::SourceFolder(), {"CMakeLists.txt", "cmake", "src", "planar", "mapping2d", "test", "bench", "examples"},
      {"CMakeLists.txt", ".cmake"}));
  EXPECT_EQ(violations, kNone) << Lines(violations);
}

SourceFile Fake(const std::string& path, const Violations& lines) { return {path, lines}; }

TEST(ArchitectureRules, CatchAnIncludeAgainstTheGraph) {
  const SourceFile map = Fake("include/planar_vslam/map/map.h", {"#pragma once"});
  const SourceFile tracker = Fake("include/planar_vslam/frontend/tracker.h", {"#pragma once"});
  const SourceFile mapper = Fake("src/backend/mapper.cpp", {"// words", "#include \"planar_vslam/map/map.h\"",
                                                            "#include \"planar_vslam/frontend/tracker.h\""});
  EXPECT_EQ(ModuleViolations({map, tracker, mapper}),
            Violations{"src/backend/mapper.cpp:3: backend may not include frontend (planar_vslam/frontend/tracker.h)"});
}

TEST(ArchitectureRules, KeepMapOutOfPlanarAndMapping2d) {
  const SourceFile map = Fake("include/planar_vslam/map/map.h", {});
  const SourceFile sensor = Fake("include/planar_vslam/sensor/scan.h", {});
  const SourceFile planar =
      Fake("planar/src/factor.cpp", {"#include <planar_vslam/map/map.h>", "#include \"planar_vslam/sensor/scan.h\""});
  const SourceFile mapping2d =
      Fake("mapping2d/include/planar_vslam/mapping2d/grid.h", {"#include \"planar_vslam/sensor/scan.h\""});
  EXPECT_EQ(ModuleViolations({map, sensor, planar, mapping2d}),
            (Violations{"planar/src/factor.cpp:1: planar may not include map (planar_vslam/map/map.h)",
                        "mapping2d/include/planar_vslam/mapping2d/grid.h:1: mapping2d may not include sensor "
                        "(planar_vslam/sensor/scan.h)"}));
}

TEST(ArchitectureRules, LetOnlyTheCommandLineSimulate) {
  const SourceFile world = Fake("include/planar_vslam/sim/world.h", {});
  const Violations include{"  #  include \"planar_vslam/sim/world.h\""};
  EXPECT_EQ(ModuleViolations({world, Fake("src/cli/simulate.cpp", include)}), kNone);
  for (const std::string module : {"io", "pipeline", "sensor"}) {
    EXPECT_EQ(ModuleViolations({world, Fake("src/" + module + "/a.cpp", include)}).size(), 1U) << module;
  }
}

TEST(ArchitectureRules, CatchPrivateHeadersOfOthersAndUnknownOnes) {
  const SourceFile private_header = Fake("src/map/derived.h", {});
  const SourceFile beside = Fake("src/map/map.cpp", {"#include \"derived.h\"", "#include <vector>"});
  const SourceFile across =
      Fake("src/optimize/a.cpp", {"#include \"../map/derived.h\"", "#include \"planar_vslam/map/gone.h\""});
  const SourceFile nowhere = Fake("src/main.cpp", {});
  EXPECT_EQ(ModuleViolations({private_header, beside, across, nowhere}),
            (Violations{"src/optimize/a.cpp:1: ../map/derived.h is private to map",
                        "src/optimize/a.cpp:2: no such header: planar_vslam/map/gone.h",
                        "src/main.cpp:1: lies in no module of the architecture"}));
}

TEST(ArchitectureRules, CatchRosAndPclAwayFromTheRim) {
  EXPECT_EQ(RimViolations({Fake("src/ros/node.cpp", {"#include <ros/ros.h>", "#include <tf2_ros/buffer.h>",
                                                     "#include \"planar_vslam/State.h\""}),
                           Fake("src/io/bag.cpp",
                                {"#include <rosbag/bag.h>", "#include <sensor_msgs/Image.h>", "#include <ros/time.h>"}),
                           Fake("mapping2d/src/cloud.cpp", {"#include <pcl/point_types.h>"})}),
            kNone);
  for (const std::string header :
       {"ros/ros.h", "tf2_ros/buffer.h", "sensor_msgs/Image.h", "std_srvs/Empty.h", "rosbag/bag.h",
        "image_transport/image_transport.h", "cv_bridge/cv_bridge.h", "planar_vslam/State.h", "pcl/point_types.h"}) {
    for (const std::string file :
         {"src/map/a.cpp", "include/planar_vslam/io/a.h", "mapping2d/include/planar_vslam/mapping2d/a.h"}) {
      EXPECT_EQ(RimViolations({Fake(file, {"#include <" + header + ">"})}).size(), 1U) << header << " in " << file;
    }
  }
  EXPECT_EQ(RimViolations({Fake("src/io/bag.cpp", {"#include <ros/node_handle.h>"})}).size(), 1U);
  EXPECT_EQ(RimViolations({Fake("src/ros/cloud.cpp", {"#include <pcl/point_types.h>"})}).size(), 1U);
}

TEST(ArchitectureRules, CatchAHeaderCycle) {
  const SourceFile a = Fake("include/planar_vslam/map/a.h", {"#include \"planar_vslam/map/b.h\""});
  const SourceFile b = Fake("include/planar_vslam/map/b.h", {"", "#include \"c.h\""});
  const SourceFile c = Fake("include/planar_vslam/map/c.h", {"#include \"planar_vslam/map/a.h\""});
  const SourceFile user =
      Fake("src/map/user.cpp", {"#include \"planar_vslam/map/a.h\"", "#include \"planar_vslam/map/c.h\""});
  EXPECT_EQ(CycleViolations({a, b, c, user}),
            Violations{"include/planar_vslam/map/c.h:1: header cycle include/planar_vslam/map/a.h -> "
                       "include/planar_vslam/map/b.h -> include/planar_vslam/map/c.h -> include/planar_vslam/map/a.h"});
  EXPECT_EQ(CycleViolations({a, Fake("include/planar_vslam/map/b.h", {}), c, user}), kNone);
}

TEST(ArchitectureRules, CatchALongFile) {
  EXPECT_EQ(LengthViolations({Fake("src/map/a.cpp", Violations(kMaxLines, "x"))}), kNone);
  EXPECT_EQ(LengthViolations({Fake("src/map/a.cpp", Violations(kMaxLines + 1, "x"))}).size(), 1U);
}

TEST(ArchitectureRules, CatchUnportableFlags) {
  EXPECT_EQ(FlagViolations({Fake("CMakeLists.txt", {"# never -march=native", "add_compile_options(-O2)"})}), kNone);
  EXPECT_EQ(
      FlagViolations({Fake("CMakeLists.txt", {"add_compile_options(-O2 -march=native)", "set(F \"-ffast-math\")"})}),
      (Violations{"CMakeLists.txt:1: compiler flag -march=native", "CMakeLists.txt:2: compiler flag -ffast-math"}));
}

}  // namespace
}  // namespace planar_vslam::test
