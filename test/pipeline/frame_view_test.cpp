// What the last frame showed: on a drive along a wall, part of which moves.
#include "planar_vslam/pipeline/frame_view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "planar_vslam/pipeline/estimator.h"
#include "support/wall_drive.h"

namespace planar_vslam {
namespace {

using test::WallDrive;

constexpr int kImages = 40, kLeft = 100, kRight = 200, kMoved = 6;  // px: a strip of the image, and how far it moves

// The strip of the view shows what is `kMoved` pixels farther right.
CameraFrame FrameWithMovedStrip(const WallDrive& drive, int image) {
  std::vector<std::uint8_t> view = drive.View(image);
  const std::vector<std::uint8_t> before = view;
  for (int y = 0; y < WallDrive::kHeight; ++y) {
    const auto row = before.begin() + static_cast<std::ptrdiff_t>(y) * WallDrive::kWidth;
    std::copy(row + kLeft + kMoved, row + kRight + kMoved,
              view.begin() + static_cast<std::ptrdiff_t>(y) * WallDrive::kWidth + kLeft);
  }
  auto pixels = std::make_shared<const std::vector<std::uint8_t>>(std::move(view));
  return {ImageFrame{WallDrive::StampOf(image), GrayImage{WallDrive::kWidth, WallDrive::kHeight, std::move(pixels)}},
          WallDrive::CameraMount()};
}

TEST(FrameView, SaysWhatIsFollowedAndWhatHasMoved) {
  EstimatorSettings settings;
  settings.camera = WallDrive::Camera();
  Estimator estimator(settings);
  EXPECT_EQ(estimator.view().features, nullptr);
  const WallDrive drive(kImages + 1);
  for (int i = 0; i < kImages; ++i) {
    estimator.Add(WallDrive::OdometryAt(i, i));
    estimator.Add(drive.FrameAt(i, i));
  }
  const std::size_t followed = estimator.view().followed.size(), refused = estimator.view().refused.size();
  EXPECT_GT(followed, 50U);
  EXPECT_TRUE(std::is_sorted(estimator.view().followed.begin(), estimator.view().followed.end()));

  estimator.Add(FrameWithMovedStrip(drive, kImages));
  const auto reports = estimator.Add(WallDrive::OdometryAt(kImages, kImages));
  ASSERT_EQ(reports.size(), 1U);
  const FrameView& view = estimator.view();
  EXPECT_EQ(static_cast<int>(view.followed.size()), reports.front().inliers);
  EXPECT_GT(view.refused.size(), refused + 10);
  long in_strip = 0;
  for (const FrameView::Refused& one : view.refused) {
    const Keypoint& seen = view.features->keypoints[one.keypoint];
    EXPECT_FALSE(std::binary_search(view.followed.begin(), view.followed.end(), one.keypoint));
    in_strip += seen.raw_pixel.x() > kLeft && seen.raw_pixel.x() < kRight &&
                std::abs(one.expected.x() - seen.raw_pixel.x() - kMoved) < 2.0;
  }
  EXPECT_GT(in_strip, static_cast<long>(view.refused.size()) / 2) << "expected where the strip was before";

  estimator.Restart();
  EXPECT_TRUE(estimator.view().image.empty());
}

}  // namespace
}  // namespace planar_vslam
