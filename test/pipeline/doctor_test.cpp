// The doctor on a simulated drive, good and with one fault at a time.
#include "planar_vslam/io/doctor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>

#include "planar_vslam/sim/dataset_writer.h"
#include "planar_vslam/sim/simulation.h"
#include "planar_vslam/sim/world.h"
#include "support/support.h"

namespace planar_vslam {
namespace {

// A recording whose events are changed on their way; nothing: lost.
using Change = std::function<std::optional<RecordedEvent>(RecordedEvent)>;
class Changed : public Recording {
 public:
  Changed(std::unique_ptr<Recording> recording, Change change)
      : recording_(std::move(recording)), change_(std::move(change)) {}
  const RecordingInfo& info() const override { return recording_->info(); }
  const std::map<std::string, long>& skipped() const override { return recording_->skipped(); }
  Expected<std::optional<RecordedEvent>> Next() override {
    while (true) {
      Expected<std::optional<RecordedEvent>> event = recording_->Next();
      if (!event.ok() || !event->has_value()) return event;
      std::optional<RecordedEvent> changed = change_(std::move(**event));
      if (changed.has_value()) return changed;
    }
  }

 private:
  std::unique_ptr<Recording> recording_;
  Change change_;
};

// Changes one kind of event.
template <class Event>
Change Of(const std::function<void(Event*)>& change) {
  return [change](RecordedEvent event) -> std::optional<RecordedEvent> {
    if (auto* own = std::get_if<Event>(&event)) change(own);
    return event;
  };
}

class DoctorTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<test::TemporaryFolder>();
    const Expected<World> world = LoadWorld(test::SourceFolder() / "config/worlds/sample_lab.yaml");
    ASSERT_TRUE(world.ok()) << world.error().message;
    SimulationOptions options;
    options.until = 22.0;
    Expected<Simulation> simulation = Simulation::Create(*world, options);
    ASSERT_TRUE(simulation.ok()) << simulation.error().message;
    ASSERT_TRUE(WriteDataset(*simulation, folder_->path() / "drive").ok());
  }
  static void TearDownTestSuite() { folder_.reset(); }

  static std::vector<Checked> Diagnose(const Change& change) {
    const auto open = [&change]() -> Expected<std::unique_ptr<Recording>> {
      Expected<std::unique_ptr<Recording>> recording = OpenRecording(folder_->path() / "drive", RecordingOptions{});
      if (!recording.ok()) return recording.error();
      return std::unique_ptr<Recording>(std::make_unique<Changed>(std::move(*recording), change));
    };
    Expected<std::vector<Checked>> checked = Examine(open, PipelineOptions(), {});
    EXPECT_TRUE(checked.ok()) << checked.error().message;
    return std::move(*checked);
  }
  // The first line of that verdict about `what` says `part`, and no line has a worse verdict.
  static void ExpectNamed(const Change& change, Verdict verdict, const std::string& what, const std::string& part) {
    bool named = false;
    std::string lines;
    for (const Checked& item : Diagnose(change)) {
      EXPECT_LE(item.verdict, verdict) << item.text;
      named = named || (item.verdict == verdict && item.what == what && item.text.find(part) != std::string::npos);
      lines += ToString(item.verdict) + " " + item.what + " " + item.text + "\n";
    }
    EXPECT_TRUE(named) << lines;
  }

  static std::unique_ptr<test::TemporaryFolder> folder_;
};
std::unique_ptr<test::TemporaryFolder> DoctorTest::folder_;

TEST_F(DoctorTest, AGoodDriveIsOk) {
  for (const Checked& item : Diagnose([](RecordedEvent event) { return event; })) {
    EXPECT_EQ(item.verdict, Verdict::kOk) << item.what << ": " << item.text;
  }
}

TEST_F(DoctorTest, OdometryThatRunsBackwardsIsBroken) {
  ExpectNamed(Of<OdometryReading>([](OdometryReading* reading) { reading->T_odom_base.translation *= -1.0; }),
              Verdict::kBroken, "odometry", "backwards");
}

TEST_F(DoctorTest, OdometryThatTurnsTheOtherWayIsBroken) {
  ExpectNamed(Of<OdometryReading>([](OdometryReading* reading) {
                reading->T_odom_base.translation.y() *= -1.0;
                reading->T_odom_base.angle *= -1.0;
              }),
              Verdict::kBroken, "odometry", "the other way");
}

TEST_F(DoctorTest, WheelsThatAreTooLongAreTold) {
  ExpectNamed(Of<OdometryReading>([](OdometryReading* reading) { reading->T_odom_base.translation *= 1.02; }),
              Verdict::kLook, "scale", "larger than by the laser");
}

TEST_F(DoctorTest, OdometryInMillimetresIsBroken) {
  ExpectNamed(Of<OdometryReading>([](OdometryReading* reading) { reading->T_odom_base.translation *= 1000.0; }),
              Verdict::kBroken, "odometry", "not in metres");
}

TEST_F(DoctorTest, ACameraThatIsTurnedIsTold) {
  const Eigen::Quaterniond yaw(Eigen::AngleAxisd(DegreesToRadians(2.0), Eigen::Vector3d::UnitZ()));
  ExpectNamed(Of<CameraFrame>(
                  [&yaw](CameraFrame* frame) { frame->T_base_camera.rotation = yaw * frame->T_base_camera.rotation; }),
              Verdict::kLook, "mount", "yaw");
}

TEST_F(DoctorTest, AClockThatIsOffIsToldByHowMuch) {
  ExpectNamed(Of<OdometryReading>([](OdometryReading* reading) { reading->stamp.nanoseconds += 80'000'000; }),
              Verdict::kLook, "clocks", " ms later");
}

TEST_F(DoctorTest, AClockThatIsFarOffIsBroken) {
  ExpectNamed(Of<OdometryReading>([](OdometryReading* reading) { reading->stamp.nanoseconds -= 500'000'000; }),
              Verdict::kBroken, "clocks", " ms earlier");
}

TEST_F(DoctorTest, ABodyFrameIsNoOpticalOne) {
  ExpectNamed(
      Of<CameraFrame>([](CameraFrame* frame) { frame->T_base_camera.rotation = Eigen::Quaterniond::Identity(); }),
      Verdict::kBroken, "mount", "body frame");
}

TEST_F(DoctorTest, ALaserUpsideDownIsBroken) {
  ExpectNamed(Of<LaserFrame>([](LaserFrame* frame) {
                frame->T_base_laser.rotation = frame->T_base_laser.rotation * Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0);
              }),
              Verdict::kBroken, "laser", "upside down");
}

TEST_F(DoctorTest, ALaserThatLooksElsewhereIsBroken) {
  const Eigen::Quaterniond yaw(Eigen::AngleAxisd(M_PI_2, Eigen::Vector3d::UnitZ()));
  ExpectNamed(
      Of<LaserFrame>([&yaw](LaserFrame* frame) { frame->T_base_laser.rotation = frame->T_base_laser.rotation * yaw; }),
      Verdict::kBroken, "laser", "about 90 deg further to the right than tf says");
}

TEST_F(DoctorTest, LostImagesAreCounted) {
  long images = 0;
  const auto half = [&images](RecordedEvent event) -> std::optional<RecordedEvent> {
    constexpr long kOfEight[] = {0, 1, 4, 6};  // irregular, as a full queue drops them
    const bool image = std::holds_alternative<CameraFrame>(event);
    const long place = image ? images++ % 8 : 0;
    if (image && std::find(std::begin(kOfEight), std::end(kOfEight), place) == std::end(kOfEight)) return std::nullopt;
    return event;
  };
  ExpectNamed(half, Verdict::kLook, "images", "lost");
}

TEST_F(DoctorTest, ProgramsReadTheSameLines) {
  const std::string json = ToJson({{Verdict::kLook, "clocks", "late"}});
  EXPECT_NE(json.find("\"verdict\": \"look\""), std::string::npos) << json;
  EXPECT_NE(json.find("\"what\": \"clocks\""), std::string::npos) << json;
}

}  // namespace
}  // namespace planar_vslam
