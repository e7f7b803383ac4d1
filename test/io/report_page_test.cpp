// The page of a run: well-formed, whole, and alone.
#include "planar_vslam/io/report_page.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <regex>
#include <vector>

#include "planar_vslam/io/trajectory.h"
#include "planar_vslam/mapping2d/grid.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReport = R"({
  "frames": {"initializing": 3, "tracking": 37, "total": 40}, "keyframes": 4, "points": 900, "metric": true,
  "scale": {"sigma": 0.001, "log_correction": 0.0, "wheels": {"log_correction": 0.02, "sigma": 0.004}, "laser": null,
            "floor": null, "known_after_meters": 0.4,
            "history": {"driven_meters": [0.1, 0.8, 1.9], "together": [[0.4, 0.2], [0.01, 0.005], [0.0, 0.001]],
                        "wheels": [null, [0.03, 0.008], [0.02, 0.004]], "laser": [null, null, null],
                        "floor": [null, null, null]}},
  "loops": [{"t": 2.0}], "findings": ["wheels <b> & images disagree"],
  "timing": {"stages_ms": {"track": {"count": 40, "sum": 80.0, "p50": 2.0, "p99": 3.0}}, "real_time_factor": 9.0},
  "configuration": {"orb.features": 800, "topics.image": "/a&b"}})";

void Write(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }

Trajectory Drive(int every) {
  Trajectory trajectory;
  for (int i = 0; i < 40; i += every) {
    const Rigid2 T(0.05 * i, 0.01 * i, 0.02 * i);
    trajectory.push_back({Timestamp::FromSeconds(0.1 * i), Embed3(T)});
  }
  return trajectory;
}

// Whether every element that is opened is closed, in order.
std::string FirstFault(const std::string& html) {
  std::vector<std::string> open;
  const std::regex tag("<(/?)([A-Za-z0-9]+)((?:[^<>\"]|\"[^\"<]*\")*?)(/?)>");
  std::string rest = html.substr(html.find("<html"));
  for (std::sregex_iterator it(rest.begin(), rest.end(), tag), end; it != end; ++it) {
    const std::string name = (*it)[2];
    if ((*it)[4].length() > 0) continue;
    if ((*it)[1].length() == 0) {
      open.push_back(name);
    } else if (open.empty() || open.back() != name) {
      return "</" + name + "> closes " + (open.empty() ? "nothing" : open.back());
    } else {
      open.pop_back();
    }
  }
  return open.empty() ? "" : "<" + open.back() + "> is left open";
}

class ReportPage : public ::testing::Test {
 protected:
  ReportPage() {
    Write(run() / "report.json", kReport);
    std::string status = "t,state,inliers,keyframe,ms\n", covariances = "t,xx,xy,xh,yy,yh,hh\n";
    for (int i = 0; i < 40; ++i) {
      const std::string t = std::to_string(0.1 * i);
      status += t + (i < 3 ? ",initializing,0,0,2\n" : ",tracking,90,0,2\n");
      covariances += t + ",1e-4,0,0,1e-4,0,1e-5\n";
    }
    Write(run() / "status.csv", status);
    Write(run() / "covariance_live.csv", covariances);
    EXPECT_TRUE(WriteTrajectory(Drive(1), run() / "trajectory.txt").ok());
    EXPECT_TRUE(WriteTrajectory(Drive(10), run() / "keyframes.txt").ok());
    OccupancyGrid2d grid;
    grid.resolution = 0.1;
    grid.width = 30;
    grid.height = 20;
    grid.cells.assign(600, 0);
    EXPECT_TRUE(WriteMapServerFiles(grid, run() / "map.yaml").ok());
  }
  const fs::path& run() const { return folder_.path(); }
  std::string Page(const ReportInput& input) const {
    const Expected<bool> written = WriteReportPage(input, run() / "page.html");
    EXPECT_TRUE(written.ok()) << written.error().message;
    std::ifstream file(run() / "page.html");
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

  test::TemporaryFolder folder_;
};

TEST_F(ReportPage, IsWholeWellFormedAndAlone) {
  ReportInput input;
  input.folder = run();
  input.truth = run() / "trajectory.txt";
  input.odometry = run() / "trajectory.txt";
  const std::string page = Page(input);
  EXPECT_EQ(FirstFault(page), "");
  for (const char* id : {"findings", "counts", "top_view", "poses", "covariance", "scale", "stages", "configuration"}) {
    EXPECT_NE(page.find("<section id=\"" + std::string(id) + "\">"), std::string::npos) << id;
  }
  EXPECT_EQ(page.find("http"), std::string::npos);
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_NE(page.find("wheels &lt;b&gt; &amp; images disagree"), std::string::npos);
  EXPECT_NE(page.find(">truth<"), std::string::npos);
  EXPECT_NE(page.find(">odometry<"), std::string::npos);
  EXPECT_NE(page.find("orb.features"), std::string::npos);
  EXPECT_NE(page.find("#ececec"), std::string::npos);  // a band where the pose was found by sight
}

TEST_F(ReportPage, TheLegendNamesOnlyWhatIsDrawn) {
  ReportInput input;
  input.folder = run();
  const std::string page = Page(input);
  EXPECT_NE(page.find(">trajectory</text>"), std::string::npos);
  long entries = 0;
  for (std::size_t at = page.find("y1=\"12\""); at != std::string::npos; at = page.find("y1=\"12\"", at + 1)) ++entries;
  EXPECT_EQ(entries, 6);  // and the loop; position and heading, of the covariance; wheels and together, of scale
  EXPECT_EQ(page.find(">truth</text>"), std::string::npos);
}

TEST_F(ReportPage, ScaleIsDrawnOverTheDistanceDriven) {
  ReportInput input;
  input.folder = run();
  const std::string page = Page(input);
  const std::string section = page.substr(page.find("<section id=\"scale\">"));
  EXPECT_LT(section.find("driven [m]"), section.find("</section>"));
  EXPECT_NE(section.find(">wheels</text>"), std::string::npos);
  EXPECT_EQ(section.find(">laser</text>"), std::string::npos);
}

TEST_F(ReportPage, OfARunWithoutAMapSaysSo) {
  Write(run() / "report.json", R"({"frames": {"total": 0}, "findings": []})");
  Write(run() / "trajectory.txt", "");
  Write(run() / "keyframes.txt", "");
  Write(run() / "covariance_live.csv", "t,xx,xy,xh,yy,yh,hh\n");
  ReportInput input;
  input.folder = run();
  const std::string page = Page(input);
  EXPECT_EQ(FirstFault(page), "");
  EXPECT_NE(page.find("There is no map to draw"), std::string::npos);
}

TEST_F(ReportPage, KeyframesOfSeveralDrivesHaveStampsInNoOrder) {
  Write(run() / "keyframes.txt", "5 0 0 0 0 0 0 1\n6 1 0 0 0 0 0 1\n2 1 1 0 0 0 0 1\n");
  ReportInput input;
  input.folder = run();
  const std::string page = Page(input);
  std::size_t dots = 0;
  for (std::size_t at = page.find("<circle"); at != std::string::npos; at = page.find("<circle", at + 1)) ++dots;
  EXPECT_EQ(dots, 3U);
}

TEST_F(ReportPage, BadInputIsNamedInOneLine) {
  ReportInput input;
  input.folder = run();
  for (const char* file : {"report.json", "status.csv", "trajectory.txt", "keyframes.txt"}) {
    const std::string before = [&] {
      std::ifstream in(run() / file);
      return std::string(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
    }();
    Write(run() / file, "no\n");
    const Expected<bool> written = WriteReportPage(input, run() / "page.html");
    ASSERT_FALSE(written.ok()) << file;
    EXPECT_NE(written.error().message.find(file), std::string::npos) << written.error().message;
    Write(run() / file, before);
  }
}

}  // namespace
}  // namespace planar_vslam
