#include <opencv2/imgproc.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include "patterns.h"
#include "planar_vslam/geometry/check.h"

namespace planar_vslam::sim {
namespace {

// Drawn with square pixels at this density, then stretched to the texture's size.
struct Sheet {
  cv::Mat grey;  // CV_8U
  double pixels_per_metre;
  cv::RNG random;

  int width() const { return grey.cols; }
  int height() const { return grey.rows; }
  int Pixels(double metres) const { return std::max(1, static_cast<int>(std::lround(metres * pixels_per_metre))); }
  int Uniform(int low, int high) { return random.uniform(low, std::max(low + 1, high)); }
  cv::Point Anywhere() { return {Uniform(0, width()), Uniform(0, height())}; }
  cv::Scalar Grey(int low, int high) { return cv::Scalar(Uniform(low, high)); }
  void Frame(int level, double metres) {
    const int thickness = Pixels(metres);
    const cv::Rect inner(thickness / 2, thickness / 2, width() - thickness, height() - thickness);
    cv::rectangle(grey, inner, cv::Scalar(level), thickness);
  }
  void Roughen(double deviation) {
    cv::Mat noise(grey.size(), CV_16S);
    random.fill(noise, cv::RNG::NORMAL, 0.0, deviation);
    cv::add(grey, noise, grey, cv::noArray(), CV_8U);
  }
};

std::string Word(Sheet& sheet, int length) {
  static constexpr char kLetters[] = "ABCDEFGHIKLMNOPRSTUVWXYZabcdefghiklmnoprstuvwxyz0123456789&%#";
  std::string word;
  for (int i = 0; i < length; ++i) word += kLetters[sheet.Uniform(0, static_cast<int>(sizeof kLetters) - 1)];
  return word;
}

// One line of words with letters `letter` px high, its base at y, from x to the right edge `right`.
void DrawLine(Sheet& sheet, int x, int y, int right, int letter, const cv::Scalar& ink) {
  constexpr double kHersheyHeight = 21.0;  // px of a capital at scale 1
  letter = std::max(letter, 4);            // px, the smallest that still shows
  const double scale = letter / kHersheyHeight;
  const int thickness = std::max(1, letter / 7);
  while (true) {
    const std::string word = Word(sheet, sheet.Uniform(2, 9));
    const int width = cv::getTextSize(word, cv::FONT_HERSHEY_SIMPLEX, scale, thickness, nullptr).width;
    if (x + width > right) return;
    cv::putText(sheet.grey, word, {x, y}, cv::FONT_HERSHEY_SIMPLEX, scale, ink, thickness, cv::LINE_AA);
    x += width + letter;
  }
}

void DrawShape(Sheet& sheet, const cv::Point& at, int size, const cv::Scalar& grey) {
  const int kind = sheet.Uniform(0, 5);
  const int filled = sheet.Uniform(0, 3) == 0 ? std::max(2, size / 6) : static_cast<int>(cv::FILLED);
  if (kind == 0) return cv::circle(sheet.grey, at, size / 2, grey, filled, cv::LINE_AA);
  if (kind == 1)
    return cv::rectangle(sheet.grey, at - cv::Point(size / 2, size / 2), at + cv::Point(size / 2, size / 3), grey,
                         filled);
  if (kind == 2)
    return cv::ellipse(sheet.grey, at, {size / 2, size / 4}, sheet.Uniform(0, 180), 0, 360, grey, filled, cv::LINE_AA);
  const int corners = sheet.Uniform(3, 8);
  const double turn = sheet.random.uniform(0.0, 2.0 * M_PI);
  std::vector<cv::Point> polygon;
  for (int i = 0; i < corners; ++i) {
    const double angle = turn + 2.0 * M_PI * i / corners, radius = size * sheet.random.uniform(0.25, 0.65);
    polygon.emplace_back(at.x + static_cast<int>(radius * std::cos(angle)),
                         at.y + static_cast<int>(radius * std::sin(angle)));
  }
  cv::fillPoly(sheet.grey, std::vector<std::vector<cv::Point>>{polygon}, grey, cv::LINE_AA);
}

void DrawText(Sheet& sheet) {
  sheet.grey = sheet.Grey(205, 245);
  const int margin = sheet.width() / 14;
  int y = margin;
  const int title = std::clamp(sheet.height() / 9, 8, sheet.Pixels(0.09));
  y += title;
  DrawLine(sheet, margin, y, sheet.width() - margin, title, sheet.Grey(0, 60));
  while (y < sheet.height() - margin) {
    const int letter = std::max(5, sheet.Pixels(sheet.random.uniform(0.010, 0.024)));
    const cv::Scalar ink = sheet.Grey(10, 90);
    const bool picture = sheet.Uniform(0, 4) == 0;
    const int block = sheet.Pixels(picture ? 0.14 : 0.12);
    const int split = picture ? sheet.Uniform(sheet.width() / 4, sheet.width() / 2) : margin;
    y += letter;
    if (picture) {
      const cv::Rect area = cv::Rect(margin, y, split - margin, block) & cv::Rect(cv::Point(), sheet.grey.size());
      cv::rectangle(sheet.grey, area, sheet.Grey(60, 170), cv::FILLED);
      for (int i = 0; i < 5; ++i)
        DrawShape(sheet, {sheet.Uniform(area.x, area.br().x), sheet.Uniform(area.y, area.br().y)}, block / 2,
                  sheet.Grey(0, 256));
    }
    for (const int end = y + block; y < end && y < sheet.height() - margin; y += 2 * letter) {
      DrawLine(sheet, split + (picture ? letter : 0), y + letter, sheet.width() - margin, letter, ink);
    }
  }
  sheet.Frame(sheet.Uniform(20, 120), 0.008);
}

void DrawShapes(Sheet& sheet) {
  sheet.grey = sheet.Grey(40, 230);
  const int side = std::min(sheet.width(), sheet.height());
  const int count = 25 + sheet.Pixels(0.5) * sheet.width() * sheet.height() / (side * side * 12 + 1);
  for (int i = 0; i < std::min(count, 120); ++i) {
    const double share = std::pow(sheet.random.uniform(0.0, 1.0), 2.0);
    DrawShape(sheet, sheet.Anywhere(), static_cast<int>(side * (0.04 + 0.32 * share * (1.0 - i / 150.0))),
              sheet.Grey(0, 256));
  }
  sheet.Frame(sheet.Uniform(0, 60), 0.012);
}

// Streets and blocks with names.
void DrawMap(Sheet& sheet) {
  sheet.grey = sheet.Grey(190, 235);
  const int reach = sheet.width() + sheet.height();
  for (int i = 0; i < 26; ++i) {
    const cv::Point at = sheet.Anywhere();
    const double angle = sheet.random.uniform(0.0, M_PI);
    const cv::Point along(static_cast<int>(reach * std::cos(angle)), static_cast<int>(reach * std::sin(angle)));
    const int thickness = sheet.Uniform(2, sheet.Pixels(0.02));
    cv::line(sheet.grey, at - along, at + along, sheet.Grey(40, 150), thickness + 2, cv::LINE_AA);
    cv::line(sheet.grey, at - along, at + along, sheet.Grey(200, 256), std::max(1, thickness - 1), cv::LINE_AA);
  }
  for (int i = 0; i < 30; ++i)
    DrawShape(sheet, sheet.Anywhere(), sheet.Pixels(sheet.random.uniform(0.01, 0.06)), sheet.Grey(30, 180));
  for (int i = 0; i < 24; ++i) {
    const cv::Point at = sheet.Anywhere();
    DrawLine(sheet, at.x, at.y, std::min(sheet.width(), at.x + sheet.Pixels(0.2)), std::max(5, sheet.Pixels(0.014)),
             sheet.Grey(0, 60));
  }
  sheet.Frame(30, 0.01);
}

// Like a photograph: shaded background, overlapping soft blobs with texture.
void DrawPhoto(Sheet& sheet) {
  cv::Mat field = 60.0 * RepeatingNoise(sheet.grey.size(), 3, 3, sheet.random) +
                  35.0 * RepeatingNoise(sheet.grey.size(), 9, 9, sheet.random) +
                  25.0 * RepeatingNoise(sheet.grey.size(), 40, 40, sheet.random) + 110.0;
  field.convertTo(sheet.grey, CV_8U);
  const int side = std::min(sheet.width(), sheet.height());
  for (int i = 0; i < 18; ++i)
    DrawShape(sheet, sheet.Anywhere(), sheet.Uniform(side / 12, side / 3), sheet.Grey(10, 246));
  sheet.Roughen(9.0);
  cv::GaussianBlur(sheet.grey, sheet.grey, cv::Size(3, 3), 0.0);
  sheet.Frame(sheet.Uniform(0, 2) * 230 + 10, 0.02);
}

// A notice board: cork with sheets of paper pinned at angles.
void DrawBoard(Sheet& sheet) {
  sheet.grey = cv::Scalar(125);
  sheet.Roughen(22.0);
  const int papers = 4 + sheet.width() * sheet.height() / (sheet.Pixels(0.3) * sheet.Pixels(0.3));
  for (int i = 0; i < papers; ++i) {
    const int width = sheet.Pixels(sheet.random.uniform(0.1, 0.22)),
              height = sheet.Pixels(sheet.random.uniform(0.1, 0.3));
    const cv::Point at(sheet.Uniform(0, sheet.width() - width), sheet.Uniform(0, sheet.height() - height));
    const cv::Rect area = cv::Rect(at.x, at.y, width, height) & cv::Rect(cv::Point(), sheet.grey.size());
    cv::rectangle(sheet.grey, area, sheet.Grey(170, 250), cv::FILLED);
    cv::rectangle(sheet.grey, area, cv::Scalar(70), 1);
    const int letter = std::max(5, sheet.Pixels(sheet.random.uniform(0.008, 0.02)));
    for (int y = at.y + 2 * letter; y < at.y + height - letter; y += 2 * letter)
      DrawLine(sheet, at.x + letter, y, at.x + width - letter, letter, sheet.Grey(0, 90));
    cv::circle(sheet.grey, at + cv::Point(width / 2, letter), letter / 2 + 2, sheet.Grey(0, 60), cv::FILLED,
               cv::LINE_AA);
  }
  sheet.Frame(50, 0.025);
}

// Spines side by side with bands and titles.
void DrawBooks(Sheet& sheet) {
  sheet.grey = cv::Scalar(25);
  for (int x = 0; x < sheet.width();) {
    const int width = sheet.Pixels(sheet.random.uniform(0.015, 0.05));
    const int top = sheet.Uniform(0, sheet.height() / 6);
    const cv::Rect spine(x, top, width, sheet.height() - top);
    const int level = sheet.Uniform(40, 225);
    cv::rectangle(sheet.grey, spine, cv::Scalar(level), cv::FILLED);
    cv::line(sheet.grey, {x + width - 1, top}, {x + width - 1, sheet.height()}, cv::Scalar(15), 2);
    const cv::Scalar ink(level > 130 ? sheet.Uniform(0, 70) : sheet.Uniform(180, 256));
    for (int i = 0; i < sheet.Uniform(1, 4); ++i) {
      const int y = sheet.Uniform(top + 2, sheet.height());
      cv::rectangle(sheet.grey, cv::Rect(x + 1, y, std::max(1, width - 3), sheet.Uniform(2, 12)), ink, cv::FILLED);
    }
    for (int y = top + sheet.height() / 5; y < sheet.height() * 4 / 5; y += std::max(6, width * 2 / 3)) {
      const double scale = width / 40.0;
      cv::putText(sheet.grey, Word(sheet, 1), {x + width / 5, y}, cv::FONT_HERSHEY_SIMPLEX, scale, ink, 1 + width / 20,
                  cv::LINE_AA);
    }
    x += width;
  }
}

void DrawDoor(Sheet& sheet) {
  sheet.grey = cv::Scalar(150);
  sheet.Roughen(5.0);
  const int inset = sheet.width() / 7;
  for (const double top : {0.08, 0.55}) {
    const cv::Rect panel(inset, static_cast<int>(top * sheet.height()), sheet.width() - 2 * inset,
                         static_cast<int>(0.36 * sheet.height()));
    cv::rectangle(sheet.grey, panel, cv::Scalar(95), sheet.Pixels(0.015));
    cv::rectangle(sheet.grey, panel - cv::Point(3, 3), cv::Scalar(190), 2);
  }
  const int plate = sheet.Pixels(0.16);
  const cv::Rect sign(sheet.width() / 2 - plate, static_cast<int>(0.15 * sheet.height()), 2 * plate, plate);
  cv::rectangle(sheet.grey, sign, cv::Scalar(235), cv::FILLED);
  cv::putText(sheet.grey, Word(sheet, 4), {sign.x + plate / 8, sign.y + plate * 2 / 3}, cv::FONT_HERSHEY_SIMPLEX,
              plate / 60.0, cv::Scalar(20), std::max(1, plate / 20), cv::LINE_AA);
  const cv::Point handle(sheet.width() - inset * 2 / 3, sheet.height() / 2);
  cv::circle(sheet.grey, handle, sheet.Pixels(0.03), cv::Scalar(40), cv::FILLED, cv::LINE_AA);
  cv::line(sheet.grey, handle, handle - cv::Point(sheet.Pixels(0.12), 0), cv::Scalar(40), sheet.Pixels(0.02),
           cv::LINE_AA);
  sheet.Frame(80, 0.05);
}

// Bright outdoors behind a cross of bars.
void DrawWindow(Sheet& sheet) {
  cv::Mat sky = 12.0 * RepeatingNoise(sheet.grey.size(), 5, 4, sheet.random) + 238.0;
  sky.convertTo(sheet.grey, CV_8U);
  for (int i = 0; i < 7; ++i) {
    const int width = sheet.Uniform(sheet.width() / 8, sheet.width() / 3),
              height = sheet.Uniform(sheet.height() / 6, sheet.height() / 2);
    const cv::Rect house(sheet.Uniform(-width / 2, sheet.width()), sheet.height() - height, width, height);
    cv::rectangle(sheet.grey, house, sheet.Grey(165, 225), cv::FILLED);
    for (int y = house.y + 8; y < house.br().y; y += 22) {
      for (int x = house.x + 6; x < house.br().x - 10; x += 18)
        cv::rectangle(sheet.grey, cv::Rect(x, y, 9, 12), cv::Scalar(120), cv::FILLED);
    }
  }
  const int bar = sheet.Pixels(0.04);
  cv::line(sheet.grey, {sheet.width() / 2, 0}, {sheet.width() / 2, sheet.height()}, cv::Scalar(110), bar);
  cv::line(sheet.grey, {0, sheet.height() / 3}, {sheet.width(), sheet.height() / 3}, cv::Scalar(110), bar);
  sheet.Frame(110, 0.06);
}

struct Style {
  const char* name;
  void (*draw)(Sheet&);
};

constexpr Style kStyles[] = {{"text", DrawText},   {"shapes", DrawShapes}, {"map", DrawMap},   {"photo", DrawPhoto},
                             {"board", DrawBoard}, {"books", DrawBooks},   {"door", DrawDoor}, {"window", DrawWindow}};

}  // namespace

cv::Mat DrawPicture(const std::string& style, cv::Size size, double width_m, double height_m, std::uint64_t seed) {
  const Style* const found =
      std::find_if(std::begin(kStyles), std::end(kStyles), [&style](const Style& s) { return style == s.name; });
  PV_CHECK(found != std::end(kStyles), "picture style " << style);
  const double density = std::max(size.width / width_m, size.height / height_m);
  // A picture that is a sliver still needs a few pixels to draw on.
  const auto side = [density](double metres) {
    return std::clamp(static_cast<int>(std::lround(metres * density)), 32, 4096);
  };
  Sheet sheet{cv::Mat(side(height_m), side(width_m), CV_8U, cv::Scalar(128)), density, cv::RNG(seed)};
  found->draw(sheet);
  cv::Mat result;
  cv::resize(sheet.grey, result, size, 0, 0, cv::INTER_AREA);
  return result;
}

}  // namespace planar_vslam::sim
