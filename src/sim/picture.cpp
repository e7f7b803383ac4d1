// Rays only where they can tell something new: a pixel between two neighbours that show the same surface shows it too,
// so one in four is asked first. What is thinner than two pixels may be missed, as between pixels' centres anyway.
// Pixels on edges get the mean of several rays.
#include "picture.h"

#include <algorithm>

#include "parallel_rows.h"
#include "planar_vslam/sim/random.h"

namespace planar_vslam::sim {
namespace {

using Eigen::Vector3f;

constexpr int kEdgeSamples = 4;  // rays of a pixel that faces meet in

// Sample positions off the pixel's centre, px: four rooks, none attacking another.
constexpr float kRooks[kEdgeSamples][2] = {{-0.125f, -0.375f}, {0.375f, -0.125f}, {0.125f, 0.375f}, {-0.375f, 0.125f}};

// Every pixel's samples sit a little elsewhere, up to half their spacing, so that rounding to quarters of a pixel
// averages out along an edge instead of moving all of it.
Eigen::Vector2f RookShift(std::size_t pixel) {
  const std::uint64_t bits = MixSeed(0, pixel);
  const auto shift = [](std::uint64_t byte) {
    return (static_cast<float>(byte & 255) - 127.5f) / 256.0f / kEdgeSamples;
  };
  return {shift(bits), shift(bits >> 8)};
}

// Works on one row at a time. Rays are collected into packets within the row, so that packets, too, are the same for
// any number of threads.
class RowPainter {
 public:
  RowPainter(const SceneImpl& scene, const RayTable& rays, const Viewpoint& viewpoint, float pixel_angle, int row,
             Picture* picture)
      : rays_(rays), eye_(scene, viewpoint, pixel_angle), row_(row), picture_(picture) {}

  // Rows 0, 2, 4, ...
  void FindSurfacesOfEvenRow() {
    for (int column = 0; column < picture_->width; column += 2) Ask(column);
    AskNow();
    for (int column = 1; column < picture_->width; column += 2) {
      const std::size_t pixel = picture_->Index(column, row_);
      const bool between = column + 1 < picture_->width && surface(pixel - 1) == surface(pixel + 1);
      if (between) surface(pixel) = surface(pixel - 1);
      if (!between) Ask(column);
    }
    AskNow();
  }
  void FindSurfacesOfOddRow() {
    const auto width = static_cast<std::size_t>(picture_->width);
    for (int column = 0; column < picture_->width; ++column) {
      const std::size_t pixel = picture_->Index(column, row_);
      const bool between = row_ + 1 < picture_->height && surface(pixel - width) == surface(pixel + width);
      if (between) surface(pixel) = surface(pixel - width);
      if (!between) Ask(column);
    }
    AskNow();
  }

  void Paint() {
    FindEdges();
    const std::uint32_t* shown = &surface(picture_->Index(0, row_));
    for (int column = 0; column < picture_->width; ++column) {
      if (OnEdge(column)) continue;
      sight_.surface[batch_.count] = shown[column];
      Add(column, rays_.At(column, row_));
      if (batch_.full()) PaintNow();
    }
    PaintNow();
    SmoothEdges();
  }

 private:
  std::uint32_t& surface(std::size_t pixel) { return picture_->surface[pixel]; }

  void Add(int column, const Vector3f& ray) {
    pixels_[batch_.count] = picture_->Index(column, row_);
    batch_.Add(ray);
  }
  void Ask(int column) {
    Add(column, rays_.At(column, row_));
    if (batch_.full()) AskNow();
  }
  void AskNow() {
    eye_.Look(batch_, &sight_);
    for (int i = 0; i < batch_.count; ++i) surface(pixels_[i]) = sight_.surface[i];
    batch_.count = 0;
  }
  void PaintNow() {
    eye_.See(batch_, &sight_);
    for (int i = 0; i < batch_.count; ++i) {
      picture_->grey[pixels_[i]] = sight_.grey[i];
      picture_->distance[pixels_[i]] = sight_.distance[i];
    }
    batch_.count = 0;
  }

  // Pixels with a neighbour that shows another surface.
  void FindEdges() {
    const int width = picture_->width;
    on_edge_.assign(static_cast<std::size_t>(width), 0);
    const std::uint32_t* own = &surface(picture_->Index(0, row_));
    const std::uint32_t* above = row_ > 0 ? own - width : own;
    const std::uint32_t* below = row_ + 1 < picture_->height ? own + width : own;
    for (int i = 0; i < width; ++i) {
      const std::uint32_t left = own[i > 0 ? i - 1 : 0], right = own[i + 1 < width ? i + 1 : i];
      const bool edge = (left != own[i]) | (right != own[i]) | (above[i] != own[i]) | (below[i] != own[i]);
      on_edge_[static_cast<std::size_t>(i)] = edge ? 1 : 0;
    }
  }
  bool OnEdge(int column) const { return on_edge_[static_cast<std::size_t>(column)] != 0; }
  void SmoothEdges() {
    for (int column = 0; column < picture_->width; ++column) {
      if (!OnEdge(column)) continue;
      const Vector3f ray = rays_.At(column, row_);
      const Vector3f step_x = rays_.At(column + 1, row_) - ray, step_y = rays_.At(column, row_ + 1) - ray;
      const Eigen::Vector2f shift = RookShift(picture_->Index(column, row_));
      for (const auto& [x, y] : kRooks) {
        Add(column, (ray + (x + shift.x()) * step_x + (y + shift.y()) * step_y).normalized());
      }
      if (batch_.full()) SmoothNow();
    }
    SmoothNow();
  }
  void SmoothNow() {
    eye_.Look(batch_, &sight_);
    eye_.See(batch_, &sight_);
    for (int i = 0; i < batch_.count; i += kEdgeSamples) {
      float grey = 0.0f, nearest = sight_.distance[i];
      for (int sample = i; sample < i + kEdgeSamples; ++sample) {
        grey += sight_.grey[sample] / kEdgeSamples;
        nearest = std::min(nearest, sight_.distance[sample]);
      }
      picture_->grey[pixels_[i]] = grey;
      picture_->distance[pixels_[i]] = nearest;
    }
    batch_.count = 0;
  }

  const RayTable& rays_;
  Eye eye_;
  int row_;
  Picture* picture_;
  RayBatch batch_{};
  Sight sight_{};
  std::size_t pixels_[RayBatch::kMost] = {};  // that the rays belong to
  std::vector<std::uint8_t> on_edge_;         // of the row's pixels: 1 or 0
};

}  // namespace

Picture TakePicture(const SceneImpl& scene, const RayTable& rays, const std::vector<Viewpoint>& rows, float pixel_angle,
                    int threads) {
  Picture picture;
  picture.width = rays.columns - 1;
  picture.height = static_cast<int>(rows.size());
  const std::size_t count = picture.Index(0, picture.height);
  picture.grey.resize(count);
  picture.distance.resize(count);
  picture.surface.resize(count);
  const auto painter = [&](int row) {
    return RowPainter(scene, rays, rows[static_cast<std::size_t>(row)], pixel_angle, row, &picture);
  };
  ForEachRow(threads, (picture.height + 1) / 2, [&](int half) { painter(2 * half).FindSurfacesOfEvenRow(); });
  ForEachRow(threads, picture.height / 2, [&](int half) { painter(2 * half + 1).FindSurfacesOfOddRow(); });
  ForEachRow(threads, picture.height, [&](int row) { painter(row).Paint(); });
  return picture;
}

}  // namespace planar_vslam::sim
