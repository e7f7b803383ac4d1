// Frames as pictures: what is drawn where, in which colour.
#include "planar_vslam/io/frame_picture.h"

#include <gtest/gtest.h>

#include <array>
#include <memory>

namespace planar_vslam::io {
namespace {

constexpr int kWidth = 80, kHeight = 60;
constexpr std::uint8_t kInk = 50;  // the image's own grey

FrameView ViewWith(const std::vector<Eigen::Vector2f>& pixels) {
  auto features = std::make_shared<FrameFeatures>();
  for (const Eigen::Vector2f& pixel : pixels) {
    Keypoint keypoint;
    keypoint.raw_pixel = pixel;
    features->keypoints.push_back(keypoint);
  }
  auto grey = std::make_shared<const std::vector<std::uint8_t>>(std::size_t{kWidth} * kHeight, kInk);
  return {GrayImage{kWidth, kHeight, std::move(grey)}, std::move(features), {}, {}};
}

std::array<int, 3> At(const ColorImage& image, int x, int y) {
  const std::size_t at =
      (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(x)) * 3;
  return {image.bgr[at], image.bgr[at + 1], image.bgr[at + 2]};
}

TEST(FramePicture, FollowedIsGreenRefusedIsRedAndLeadsToWhereItWasExpected) {
  FrameView view = ViewWith({{10.0F, 10.0F}, {40.0F, 10.0F}, {10.0F, 40.0F}});
  view.followed = {0};
  view.refused = {{1, {70.0, 10.0}}};
  const ColorImage image = DrawFrame(view, {"tracking", "waiting"});
  ASSERT_EQ(image.width, kWidth);
  EXPECT_GT(image.height, kHeight) << "the text is below";
  ASSERT_EQ(image.bgr.size(), static_cast<std::size_t>(image.width * image.height) * 3);
  const auto [blue, green, red] = At(image, 13, 10);
  EXPECT_TRUE(green > red && green > blue) << "a ring around what is followed";
  for (const int x : {43, 55, 69}) {
    const auto [b, g, r] = At(image, x, 10);
    EXPECT_TRUE(r > g && r > b) << x;
  }
  const auto [b, g, r] = At(image, 10, 40);
  EXPECT_TRUE(b == g && g == r && g > kInk) << "a keypoint that is no landmark";
  EXPECT_EQ(At(image, 75, 55), (std::array<int, 3>{kInk, kInk, kInk})) << "the image elsewhere";
}

TEST(FramePicture, DrawsWhatLiesOutsideAndNothingOfNothing) {
  FrameView view = ViewWith({{10.0F, 10.0F}});
  view.refused = {{0, {-1e6, 1e6}}};
  EXPECT_EQ(DrawFrame(view, {}).height, kHeight);
  view.features.reset();
  view.refused.clear();
  EXPECT_FALSE(DrawFrame(view, {}).bgr.empty()) << "an image whose features are not known";
  EXPECT_TRUE(DrawFrame(FrameView{}, {"lost"}).bgr.empty());
}

}  // namespace
}  // namespace planar_vslam::io
