#pragma once
// SVG pictures: a set of axes, text, and the file.
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "planar_vslam/geometry/expected.h"
#include "planar_vslam/geometry/rigid2.h"
#include "planar_vslam/mapping2d/grid.h"

namespace planar_vslam::io {

// Rectangle of the picture in px.
struct PixelBox {
  double left, top, width, height;
};

class SvgPanel {
 public:
  // The box shows x from x_min to x_max and y from y_min to y_max, y upwards; with `equal_axes` a metre is as long on
  // both axes and the shorter range is widened about its middle.
  SvgPanel(const PixelBox& box, double x_min, double x_max, double y_min, double y_max, bool equal_axes);

  // Frame, grid lines at round numbers, their values, and the names of the axes.
  std::string Axes(const std::string& x_label, const std::string& y_label) const;
  std::string Line(const std::vector<std::pair<double, double>>& points, const std::string& color, double width) const;
  std::string Dot(double x, double y, const std::string& color) const;
  // The grid's known cells where the frame it is in lies at `T_panel_grid`; drawn as far as the box goes.
  std::string Cells(const OccupancyGrid2d& grid, const Rigid2& T_panel_grid) const;

 private:
  double PixelX(double x) const { return box_.left + (x - x_min_) / (x_max_ - x_min_) * box_.width; }
  double PixelY(double y) const { return box_.top + (y_max_ - y) / (y_max_ - y_min_) * box_.height; }

  PixelBox box_;
  double x_min_, x_max_, y_min_, y_max_;
};

std::string SvgText(double x, double y, const std::string& text, const std::string& anchor, double size_px);

// A picture of that size in px, white, with `content` on it. Error: that the file cannot be written.
Expected<bool> WriteSvg(const std::string& content, double width, double height, const std::filesystem::path& path);

}  // namespace planar_vslam::io
