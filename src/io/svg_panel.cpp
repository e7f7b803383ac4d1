#include "svg_panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>

namespace planar_vslam::io {
namespace {

constexpr double kFontSize = 12.0;       // px
constexpr double kFewestTicks = 4.0;     // about, on a short axis
constexpr double kPixelsPerTick = 90.0;  // about this far apart
constexpr double kSmallestRange = 1e-3;  // axis units; a standing robot still gets axes

// 1, 2 or 5 times a power of ten, at least `wanted`.
double RoundStep(double wanted) {
  const double power = std::pow(10.0, std::floor(std::log10(wanted)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= wanted) return factor * power;
  }
  return 10.0 * power;
}

void Widen(double* low, double* high, double range) {
  const double middle = 0.5 * (*low + *high);
  *low = middle - 0.5 * range;
  *high = middle + 0.5 * range;
}

// Multiples of a round step inside [low, high] on an axis of `length` px.
struct Ticks {
  double step;
  long first, last;
};

Ticks TicksOf(double low, double high, double length) {
  const double step = RoundStep((high - low) * std::min(kPixelsPerTick / length, 1.0 / kFewestTicks));
  constexpr double kSlack = 1e-9;  // steps: keeps a tick that lies on the border
  return {step, std::lround(std::ceil(low / step - kSlack)), std::lround(std::floor(high / step + kSlack))};
}

std::string TickLabel(long index, double step) { return fmt::format("{:.6g}", static_cast<double>(index) * step); }

std::string GridLine(double x1, double y1, double x2, double y2) {
  return fmt::format("<line x1=\"{:.2f}\" y1=\"{:.2f}\" x2=\"{:.2f}\" y2=\"{:.2f}\" stroke=\"#e0e0e0\"/>\n", x1, y1, x2,
                     y2);
}

// The cells of one kind as rectangles, a run of a row each, in cells.
std::string RunsOf(const OccupancyGrid2d& grid, std::int8_t value) {
  std::string path;
  for (int y = 0; y < grid.height; ++y) {
    for (int x = 0; x < grid.width;) {
      const int first = x;
      while (x < grid.width && grid.At(x, y) == value) ++x;
      if (x > first) path += fmt::format("M{0} {1}h{2}v1h-{2}z", first, y, x - first);
      if (x == first) ++x;
    }
  }
  return path;
}

}  // namespace

SvgPanel::SvgPanel(const PixelBox& box, double x_min, double x_max, double y_min, double y_max, bool equal_axes)
    : box_(box), x_min_(x_min), x_max_(x_max), y_min_(y_min), y_max_(y_max) {
  Widen(&x_min_, &x_max_, std::max(x_max - x_min, kSmallestRange));
  if (y_max - y_min < kSmallestRange) y_max_ = y_min + kSmallestRange;
  if (!equal_axes) return;
  const double units_per_px = std::max((x_max_ - x_min_) / box.width, (y_max_ - y_min_) / box.height);
  Widen(&x_min_, &x_max_, units_per_px * box.width);
  Widen(&y_min_, &y_max_, units_per_px * box.height);
}

std::string SvgPanel::Axes(const std::string& x_label, const std::string& y_label) const {
  constexpr double kTickGap = 6.0, kXLabelGap = 36.0, kYLabelGap = 46.0;  // px
  const double right = box_.left + box_.width, bottom = box_.top + box_.height;
  std::string svg;
  const Ticks xs = TicksOf(x_min_, x_max_, box_.width);
  for (long i = xs.first; i <= xs.last; ++i) {
    const double x = PixelX(static_cast<double>(i) * xs.step);
    svg += GridLine(x, box_.top, x, bottom);
    svg += SvgText(x, bottom + kTickGap + kFontSize, TickLabel(i, xs.step), "middle", kFontSize);
  }
  const Ticks ys = TicksOf(y_min_, y_max_, box_.height);
  for (long i = ys.first; i <= ys.last; ++i) {
    const double y = PixelY(static_cast<double>(i) * ys.step);
    svg += GridLine(box_.left, y, right, y);
    svg += SvgText(box_.left - kTickGap, y + kFontSize / 3.0, TickLabel(i, ys.step), "end", kFontSize);
  }
  svg += fmt::format(
      "<rect x=\"{:.2f}\" y=\"{:.2f}\" width=\"{:.2f}\" height=\"{:.2f}\" fill=\"none\" stroke=\"#404040\"/>\n",
      box_.left, box_.top, box_.width, box_.height);
  svg += SvgText(box_.left + box_.width / 2.0, bottom + kXLabelGap, x_label, "middle", kFontSize);
  const double label_x = box_.left - kYLabelGap, label_y = box_.top + box_.height / 2.0;
  svg += fmt::format("<g transform=\"rotate(-90 {0:.2f} {1:.2f})\">{2}</g>\n", label_x, label_y,
                     SvgText(label_x, label_y, y_label, "middle", kFontSize));
  return svg;
}

std::string SvgPanel::Line(const std::vector<std::pair<double, double>>& points, const std::string& color,
                           double width) const {
  if (points.size() < 2) return "";
  std::string svg =
      fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{:.1f}\" stroke-linejoin=\"round\" points=\"",
                  color, width);
  for (const auto& [x, y] : points) svg += fmt::format("{:.2f},{:.2f} ", PixelX(x), PixelY(y));
  svg.back() = '"';
  return svg + "/>\n";
}

std::string SvgPanel::Dot(double x, double y, const std::string& color) const {
  constexpr double kRadius = 4.0;  // px
  return fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.1f}\" fill=\"{}\"/>\n", PixelX(x), PixelY(y), kRadius,
                     color);
}

std::string SvgPanel::Cells(const OccupancyGrid2d& grid, const Rigid2& T_panel_grid) const {
  constexpr std::int8_t kFree = 0, kOccupied = 100;
  const Rigid2 T_panel_corner = T_panel_grid * Rigid2(grid.origin.x(), grid.origin.y(), 0.0);
  const double px = box_.width / (x_max_ - x_min_) * grid.resolution;  // of a cell
  const double c = px * std::cos(T_panel_corner.angle), s = px * std::sin(T_panel_corner.angle);
  const Eigen::Vector2d& t = T_panel_corner.translation;
  return fmt::format(
      "<svg x=\"{0:.2f}\" y=\"{1:.2f}\" width=\"{2:.2f}\" height=\"{3:.2f}\" viewBox=\"{0:.2f} {1:.2f} {2:.2f} "
      "{3:.2f}\">\n<g transform=\"matrix({4:.6f} {5:.6f} {6:.6f} {7:.6f} {8:.2f} {9:.2f})\" "
      "shape-rendering=\"crispEdges\">\n<path fill=\"#f1f4ec\" d=\"{10}\"/>\n<path fill=\"#3a3a3a\" "
      "d=\"{11}\"/>\n</g></svg>\n",
      box_.left, box_.top, box_.width, box_.height, c, -s, -s, -c, PixelX(t.x()), PixelY(t.y()), RunsOf(grid, kFree),
      RunsOf(grid, kOccupied));
}

std::string SvgText(double x, double y, const std::string& text, const std::string& anchor, double size_px) {
  return fmt::format(
      "<text x=\"{:.2f}\" y=\"{:.2f}\" font-size=\"{:.0f}\" text-anchor=\"{}\" fill=\"#202020\">{}</text>\n", x, y,
      size_px, anchor, text);
}

Expected<bool> WriteSvg(const std::string& content, double width, double height, const std::filesystem::path& path) {
  std::ofstream stream(path);
  stream << fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.0f}\" height=\"{1:.0f}\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"sans-serif\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      width, height);
  stream << content << "</svg>\n";
  stream.flush();
  if (!stream) return Error{fmt::format("{}: cannot be written", path.string())};
  return true;
}

}  // namespace planar_vslam::io
