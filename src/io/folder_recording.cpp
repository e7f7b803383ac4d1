#include "folder_recording.h"

#include <fmt/format.h>

#include "folder_layouts.h"
#include "image_decode.h"
#include "scan_table.h"

namespace planar_vslam::io {
namespace {

namespace fs = std::filesystem;

class FolderRecording : public Recording {
 public:
  FolderRecording(FolderContents contents, const RecordingInfo& info, std::unique_ptr<ScanTable> scans, SkipLog skipped)
      : contents_(std::move(contents)), info_(info), scans_(std::move(scans)), skipped_(std::move(skipped)) {}

  const RecordingInfo& info() const override { return info_; }
  const std::map<std::string, long>& skipped() const override { return skipped_.counts(); }
  Expected<std::optional<RecordedEvent>> Next() override;

 private:
  std::optional<CameraFrame> LoadImage(const ImageFile& file);

  FolderContents contents_;
  RecordingInfo info_;
  std::unique_ptr<ScanTable> scans_;  // null without a laser
  SkipLog skipped_;
  GreyDepth depth_;
  std::size_t next_image_ = 0, next_odometry_ = 0;
};

// At equal stamps odometry comes first, then the sweep, then the image that needs both.
Expected<std::optional<RecordedEvent>> FolderRecording::Next() {
  constexpr Timestamp kNever{std::numeric_limits<std::int64_t>::max()};
  while (true) {
    if (scans_ != nullptr) {
      if (const auto error = scans_->Advance(&skipped_)) return *error;
    }
    const bool more_odometry = next_odometry_ < contents_.odometry.size();
    const bool more_images = next_image_ < contents_.images.size();
    const bool more_scans = scans_ != nullptr && scans_->current().has_value();
    const Timestamp odometry = more_odometry ? contents_.odometry[next_odometry_].stamp : kNever;
    const Timestamp image = more_images ? contents_.images[next_image_].stamp : kNever;
    const Timestamp scan = more_scans ? scans_->current()->stamp : kNever;
    if (!more_odometry && !more_images && !more_scans) return std::optional<RecordedEvent>();
    if (more_odometry && odometry <= scan && odometry <= image) {
      return std::optional<RecordedEvent>(contents_.odometry[next_odometry_++]);
    }
    if (more_scans && scan <= image) {
      return std::optional<RecordedEvent>(LaserFrame{scans_->Take(), *contents_.calibration.T_base_laser});
    }
    std::optional<CameraFrame> frame = LoadImage(contents_.images[next_image_++]);
    if (frame.has_value()) return std::optional<RecordedEvent>(std::move(*frame));
  }
}

std::optional<CameraFrame> FolderRecording::LoadImage(const ImageFile& file) {
  const std::optional<Rigid3> T_base_camera = contents_.head.has_value()
                                                  ? contents_.head->At(file.stamp)
                                                  : contents_.calibration.T_base_camera.value_or(Rigid3{});
  if (!T_base_camera.has_value()) {
    skipped_.Count("image outside base_camera.txt", file.path.string());
    return std::nullopt;
  }
  if (!fs::is_regular_file(file.path)) {
    skipped_.Count("image file missing", file.path.string());
    return std::nullopt;
  }
  std::optional<GrayImage> image = DecodeImageFile(file.path, &depth_);
  if (!image.has_value()) {
    skipped_.Count("image not decodable", fmt::format("{}; expected {}", file.path.string(), kImageFormats));
    return std::nullopt;
  }
  if (image->width != info_.camera.width || image->height != info_.camera.height) {
    skipped_.Count("image of changed size", fmt::format("{}: {}x{}, expected {}x{}", file.path.string(), image->width,
                                                        image->height, info_.camera.width, info_.camera.height));
    return std::nullopt;
  }
  return CameraFrame{ImageFrame{file.stamp, std::move(*image)}, *T_base_camera};
}

// Takes the image size from the first image that can be read, or checks it against the calibration.
std::optional<Error> CheckImageSize(FolderContents* contents) {
  CameraModel& camera = contents->calibration.camera;
  for (const ImageFile& file : contents->images) {
    GreyDepth depth;
    const std::optional<GrayImage> image = DecodeImageFile(file.path, &depth);
    if (!image.has_value()) continue;
    if (camera.width == 0) {
      camera.width = image->width;
      camera.height = image->height;
    }
    if (camera.width == image->width && camera.height == image->height) return std::nullopt;
    return Error{fmt::format("{}: {}x{} px; expected {}x{} as {} says", file.path.string(), image->width, image->height,
                             camera.width, camera.height, contents->calibration_file.string())};
  }
  return Error{fmt::format("{}: missing or not decodable, and so is every other listed image; expected {}",
                           contents->images.front().path.string(), kImageFormats)};
}

}  // namespace

Expected<std::unique_ptr<Recording>> OpenFolderRecording(const fs::path& folder, const RecordingOptions& options) {
  SkipLog skipped;
  Expected<FolderContents> contents = ReadFolder(folder, options, &skipped);
  if (!contents) return contents.error();
  if (options.require_odometry && contents->odometry.empty()) {
    return Error{fmt::format("{}: no odometry.csv; odometry is required", folder.string())};
  }
  if (const auto error = CheckImageSize(&*contents)) return *error;
  std::unique_ptr<ScanTable> scans;
  if (contents->scans.has_value()) {
    Expected<std::unique_ptr<ScanTable>> table = ScanTable::Open(*contents->scans, *contents->calibration.laser);
    if (!table) return table.error();
    scans = std::move(*table);
    if (const auto error = scans->Advance(&skipped)) return *error;
  }
  RecordingInfo info;
  info.camera = contents->calibration.camera;
  info.has_odometry = !contents->odometry.empty();
  info.has_laser = scans != nullptr && scans->current().has_value();
  info.has_base_transform = contents->has_base_transform();
  info.first_image = contents->images.front().stamp;
  info.last_image = contents->images.back().stamp;
  info.image_count = static_cast<long>(contents->images.size());
  return std::unique_ptr<Recording>(
      std::make_unique<FolderRecording>(std::move(*contents), info, std::move(scans), std::move(skipped)));
}

}  // namespace planar_vslam::io
