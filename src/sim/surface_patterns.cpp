#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>

#include "patterns.h"
#include "planar_vslam/geometry/check.h"
#include "planar_vslam/sim/world.h"

namespace planar_vslam::sim {
namespace {

// What every style draws with: a canvas in grey levels (float) and where its numbers come from.
struct Canvas {
  cv::Mat grey;   // CV_32F
  double metres;  // side length
  cv::RNG random;

  int pixels() const { return grey.cols; }
  // How many features of about `length` metres fit along a side.
  int Count(double length) const { return std::max(1, static_cast<int>(std::lround(metres / length))); }
  int Position(int index, int count) const {
    return static_cast<int>(static_cast<std::int64_t>(index) * pixels() / count);
  }
  void AddNoise(double amplitude, double length_x, double length_y) {
    grey += amplitude * RepeatingNoise(grey.size(), Count(length_x), Count(length_y), random);
  }
  // White noise, one value a pixel.
  void AddGrain(double deviation) {
    cv::Mat grain(grey.size(), CV_32F);
    random.fill(grain, cv::RNG::NORMAL, 0.0, deviation);
    grey += grain;
  }
};

void DrawPlaster(Canvas& canvas) {
  canvas.AddNoise(7.0, 0.7, 0.7);
  canvas.AddNoise(5.0, 0.15, 0.15);
  canvas.AddNoise(4.0, 0.03, 0.03);
  canvas.AddGrain(3.0);
  // Scuffs: short faint strokes.
  for (int i = 0; i < canvas.Count(0.12) * 2; ++i) {
    const cv::Point from(canvas.random.uniform(0, canvas.pixels()), canvas.random.uniform(0, canvas.pixels()));
    const cv::Point to = from + cv::Point(canvas.random.uniform(-30, 31), canvas.random.uniform(-12, 13));
    const double level = canvas.grey.at<float>(from) - canvas.random.uniform(6.0, 30.0);
    cv::line(canvas.grey, from, to, cv::Scalar(level), canvas.random.uniform(1, 3), cv::LINE_AA);
  }
}

// Rectangles in rows, each with its own tint, dark joints between; every second row is shifted by half a piece.
void DrawMasonry(Canvas& canvas, double piece_x, double piece_y, bool shifted, double tint, double joint_level) {
  const int columns = canvas.Count(piece_x), rows = (canvas.Count(piece_y) + 1) / 2 * 2;
  constexpr int kJoint = 3;  // px
  for (int row = 0; row < rows; ++row) {
    const int y0 = canvas.Position(row, rows), y1 = canvas.Position(row + 1, rows);
    const int shift = shifted && row % 2 == 1 ? canvas.Position(1, columns) / 2 : 0;
    for (int column = 0; column < columns; ++column) {
      const int x0 = canvas.Position(column, columns) + shift, x1 = canvas.Position(column + 1, columns) + shift;
      const cv::Scalar change(canvas.random.gaussian(tint));
      // A shifted row's last piece continues at the left border.
      for (const int wrap : {0, canvas.pixels()}) {
        const cv::Rect piece = cv::Rect(x0 - wrap, y0, x1 - x0, y1 - y0) & cv::Rect(cv::Point(), canvas.grey.size());
        if (piece.empty()) continue;
        canvas.grey(piece) += change;
        const cv::Rect joint = cv::Rect(x0 - wrap, y0, kJoint, y1 - y0) & piece;
        if (!joint.empty()) canvas.grey(joint) = joint_level;
      }
    }
    canvas.grey(cv::Rect(0, y0, canvas.pixels(), kJoint)) = joint_level;
  }
}

void DrawTiles(Canvas& canvas) {
  canvas.AddNoise(9.0, 0.25, 0.25);
  canvas.AddNoise(7.0, 0.05, 0.05);
  canvas.AddNoise(7.0, 0.015, 0.015);
  DrawMasonry(canvas, 0.41, 0.41, false, 7.0, 70.0);
  canvas.AddGrain(4.0);
  // Terrazzo chips.
  for (int i = 0; i < canvas.Count(0.06) * canvas.Count(0.06); ++i) {
    const cv::Point at(canvas.random.uniform(0, canvas.pixels()), canvas.random.uniform(0, canvas.pixels()));
    const cv::Size axes(canvas.random.uniform(1, 6), canvas.random.uniform(1, 4));
    cv::ellipse(canvas.grey, at, axes, canvas.random.uniform(0.0, 180.0), 0, 360,
                cv::Scalar(canvas.random.uniform(60.0, 215.0)), cv::FILLED, cv::LINE_AA);
  }
}

void DrawBrick(Canvas& canvas) {
  canvas.AddNoise(10.0, 0.05, 0.05);
  canvas.AddNoise(8.0, 0.012, 0.012);
  DrawMasonry(canvas, 0.24, 0.08, true, 16.0, 190.0);
  canvas.AddGrain(4.0);
}

// Grain along x: stretched noise, sharpened into lines by a sine of its value.
void DrawWood(Canvas& canvas) {
  const cv::Mat bend = RepeatingNoise(canvas.grey.size(), canvas.Count(0.9), canvas.Count(0.06), canvas.random);
  const cv::Mat fibre = RepeatingNoise(canvas.grey.size(), canvas.Count(0.25), canvas.Count(0.006), canvas.random);
  for (int y = 0; y < canvas.grey.rows; ++y) {
    float* grey = canvas.grey.ptr<float>(y);
    for (int x = 0; x < canvas.grey.cols; ++x) {
      grey[x] += 13.0f * std::sin(11.0f * bend.at<float>(y, x)) + 11.0f * fibre.at<float>(y, x);
    }
  }
  canvas.AddGrain(3.0);
}

void DrawPlanks(Canvas& canvas) {
  DrawWood(canvas);
  DrawMasonry(canvas, 1.0, 0.12, true, 13.0, 55.0);
}

void DrawFabric(Canvas& canvas) {
  canvas.AddNoise(9.0, 0.1, 0.1);
  canvas.AddNoise(16.0, 0.012, 0.006);
  canvas.AddNoise(16.0, 0.006, 0.012);
  canvas.AddGrain(7.0);
}

// Ceiling panels with a sparse pattern of holes.
void DrawPanels(Canvas& canvas) {
  canvas.AddGrain(2.0);
  DrawMasonry(canvas, 0.6, 0.6, false, 4.0, 120.0);
  for (int i = 0; i < canvas.Count(0.05) * canvas.Count(0.05); ++i) {
    const cv::Point at(canvas.random.uniform(0, canvas.pixels()), canvas.random.uniform(0, canvas.pixels()));
    cv::circle(canvas.grey, at, canvas.random.uniform(1, 4), cv::Scalar(canvas.random.uniform(90.0, 160.0)), cv::FILLED,
               cv::LINE_AA);
  }
}

struct Style {
  const char* name;
  int shade;  // default mean grey level
  void (*draw)(Canvas&);
};

constexpr Style kStyles[] = {{"plain", 160, [](Canvas&) {}}, {"plaster", 196, DrawPlaster}, {"brick", 135, DrawBrick},
                             {"tiles", 150, DrawTiles},      {"planks", 128, DrawPlanks},   {"wood", 140, DrawWood},
                             {"fabric", 85, DrawFabric},     {"panels", 205, DrawPanels}};

}  // namespace

cv::Mat RepeatingNoise(cv::Size size, int cells_x, int cells_y, cv::RNG& random) {
  constexpr int kMargin = 2;  // cells, what cubic interpolation reaches over the border
  cv::Mat cells(std::min(cells_y, size.height), std::min(cells_x, size.width), CV_32F), wrapped, grown;
  random.fill(cells, cv::RNG::NORMAL, 0.0, 0.6);
  cv::copyMakeBorder(cells, wrapped, kMargin, kMargin, kMargin, kMargin, cv::BORDER_WRAP);
  const int px = size.width / cells.cols + 1, py = size.height / cells.rows + 1;  // per cell, at least
  cv::resize(wrapped, grown, cv::Size(wrapped.cols * px, wrapped.rows * py), 0, 0, cv::INTER_CUBIC);
  const cv::Mat period = grown(cv::Rect(kMargin * px, kMargin * py, cells.cols * px, cells.rows * py));
  cv::Mat noise;
  cv::resize(period, noise, size, 0, 0, cv::INTER_LINEAR);
  return noise;
}

cv::Mat DrawSurface(const std::string& style, int shade, int pixels, double metres, std::uint64_t seed) {
  const Style* const found =
      std::find_if(std::begin(kStyles), std::end(kStyles), [&style](const Style& s) { return style == s.name; });
  PV_CHECK(found != std::end(kStyles), "surface style " << style);
  const int mean = shade == TextureSpec::kDefaultShade ? found->shade : shade;
  Canvas canvas{cv::Mat(pixels, pixels, CV_32F, cv::Scalar(mean)), metres, cv::RNG(seed)};
  found->draw(canvas);
  cv::Mat result;
  canvas.grey.convertTo(result, CV_8U);
  return result;
}

}  // namespace planar_vslam::sim
