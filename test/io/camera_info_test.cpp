// What a camera_info says of lens, region of interest and binning.
#include <gtest/gtest.h>

#include "bag_testing.h"

namespace planar_vslam::test {
namespace {

class CameraInfos : public BagFixture {
 protected:
  // The camera of an image as large as it.
  Replay PlayInfo(const sensor_msgs::CameraInfo& info, int width = kTestWidth, int height = kTestHeight) const {
    {
      BagWriter writer(Path());
      writer.PutInfo(info);
      writer.PutImage(0.1, RawImage(RampImage(width, height), "mono8"));
    }
    return Play(Path());
  }
};

TEST_P(CameraInfos, BinningAndRegionsOfInterestChangeTheIntrinsics) {
  sensor_msgs::CameraInfo info = Info();
  info.binning_x = info.binning_y = 2;
  const Replay half = PlayInfo(info, kTestWidth / 2, kTestHeight / 2);
  ASSERT_EQ(half.images.size(), 1U) << half.error;
  EXPECT_EQ(half.info.camera.fx, 15.0);
  EXPECT_EQ(half.info.camera.cy, 6.0);
  EXPECT_EQ(half.info.camera.width, kTestWidth / 2);
  info = Info();
  info.roi.x_offset = 4;
  info.roi.y_offset = 2;
  info.roi.width = 20;
  info.roi.height = 16;
  const Replay part = PlayInfo(info, 20, 16);
  ASSERT_EQ(part.images.size(), 1U) << part.error;
  EXPECT_EQ(part.info.camera.fx, 30.0);
  EXPECT_EQ(part.info.camera.cx, 12.0);
  EXPECT_EQ(part.info.camera.cy, 10.0);
  info.binning_x = info.binning_y = 2;
  const Replay both = PlayInfo(info, 10, 8);
  ASSERT_EQ(both.images.size(), 1U) << both.error;
  EXPECT_EQ(both.info.camera.cx, 6.0);
  info.roi.width = 40;
  ExpectInError(PlayInfo(info).error, {"/camera/camera_info", "roi"});
}

TEST_P(CameraInfos, LensesComeInManySpellings) {
  const auto lens = [&](const std::string& model, const std::vector<double>& D) {
    sensor_msgs::CameraInfo info = Info();
    info.distortion_model = model;
    info.D = D;
    const Replay replay = PlayInfo(info);
    EXPECT_EQ(replay.images.size(), 1U) << model << ": " << replay.error;
    return replay.info.camera;
  };
  const std::vector<double> five = {0.1, -0.2, 0.001, 0.002, 0.03},
                            eight = {0.1, -0.2, 0.001, 0.002, 0.03, 0.2, 0.1, 0.01};
  std::vector<double> padded = five;
  for (const std::size_t size : {5U, 8U, 12U, 14U}) {
    padded.resize(size, 0.0);
    for (const char* model : {"plumb_bob", "rational_polynomial", ""}) {
      const CameraModel camera = lens(model, padded);
      EXPECT_EQ(camera.k3, 0.03);
      EXPECT_EQ(camera.k4, 0.0);
      EXPECT_EQ(camera.lens, Lens::kRadial);
    }
  }
  EXPECT_EQ(lens("plumb_bob", {0.1, -0.2, 0.001, 0.002}).p2, 0.002);
  for (const char* model : {"plumb_bob", "rational_polynomial"}) EXPECT_EQ(lens(model, eight).k6, 0.01);
  for (const char* model : {"plumb_bob", "", "something else"}) EXPECT_FALSE(lens(model, {}).distorted());
  for (const std::vector<double>& D : {std::vector<double>(), {0.0, 0.0, 0.0, 0.0}, {0.1, 0.02, 0.0, 0.0}}) {
    for (const char* model : {"equidistant", "fisheye", "equi", "Kannala_Brandt"}) {
      EXPECT_EQ(lens(model, D).lens, Lens::kEquidistant) << "a fisheye even where all coefficients are zero";
    }
  }
  EXPECT_EQ(lens("radtan", {0.1, -0.2, 0.001, 0.002}).p2, 0.002);
}

TEST_P(CameraInfos, LensesThatAreNotSupportedAreNamed) {
  for (const auto& [model, D] : {std::pair<std::string, std::vector<double>>("omni", {0.1, 0.2, 0.3, 0.4}),
                                 {"plumb_bob", {0.1, 0.2, 0.3}},
                                 {"equidistant", {0.1, 0.2}},
                                 {"rational_polynomial", {0.1, 0, 0, 0, 0, 0, 0, 0, 0.01, 0, 0, 0}}}) {
    sensor_msgs::CameraInfo info = Info();
    info.distortion_model = model;
    info.D = D;
    ExpectInError(PlayInfo(info).error, {"/camera/camera_info", model, "expected"});
  }
}

PV_WITH_EVERY_KIND_OF_BAG(CameraInfos);

}  // namespace
}  // namespace planar_vslam::test
