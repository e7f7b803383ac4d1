#include "planar_vslam/sensor/lens.h"

#include <algorithm>
#include <cctype>
#include <sstream>

namespace planar_vslam {
namespace {

constexpr std::size_t kPlumbBob = 5, kRational = 8;  // numbers
constexpr std::size_t kEquidistant = 4;

std::string LowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool AllZero(const std::vector<double>& values, std::size_t from) {
  return std::all_of(values.begin() + static_cast<std::ptrdiff_t>(std::min(from, values.size())), values.end(),
                     [](double value) { return value == 0.0; });
}

Error Unsupported(const LensText& lens, const char* expected) {
  std::ostringstream line;
  line << "distortion_model '" << lens.model << "' with " << lens.coefficients.size() << " numbers in D; expected "
       << expected;
  return Error{line.str()};
}

// Calibration tools have names of their own for the models of camera_info.
bool IsEquidistant(const std::string& name) {
  return name == "equidistant" || name == "fisheye" || name == "equi" || name == "kannala_brandt";
}
bool IsPolynomial(const std::string& name) {
  return name == "plumb_bob" || name == "rational_polynomial" || name == "radtan" || name.empty();
}

Expected<bool> SetEquidistant(const LensText& lens, CameraModel* camera) {
  const std::vector<double>& D = lens.coefficients;
  if (!D.empty() && (D.size() < kEquidistant || !AllZero(D, kEquidistant))) {
    return Unsupported(lens, "k1 k2 k3 k4");
  }
  camera->lens = Lens::kEquidistant;
  double* const targets[] = {&camera->k1, &camera->k2, &camera->k3, &camera->k4};
  for (std::size_t i = 0; i < kEquidistant && !D.empty(); ++i) *targets[i] = D[i];
  return true;
}

}  // namespace

LensText DescribeLens(const CameraModel& c) {
  if (c.lens == Lens::kEquidistant) return {"equidistant", {c.k1, c.k2, c.k3, c.k4}};
  const bool rational = c.k4 != 0.0 || c.k5 != 0.0 || c.k6 != 0.0;
  LensText lens{rational ? "rational_polynomial" : "plumb_bob", {c.k1, c.k2, c.p1, c.p2, c.k3}};
  if (rational) lens.coefficients.insert(lens.coefficients.end(), {c.k4, c.k5, c.k6});
  return lens;
}

Expected<bool> SetLens(const LensText& lens, CameraModel* camera) {
  const std::string name = LowerCase(lens.model);
  const std::vector<double>& D = lens.coefficients;
  if (IsEquidistant(name)) return SetEquidistant(lens, camera);
  if (AllZero(D, 0)) return true;
  if (!IsPolynomial(name)) return Unsupported(lens, "plumb_bob, rational_polynomial or equidistant");
  for (const std::size_t known : {kPlumbBob - 1, kPlumbBob, kRational, kRational + 4, kRational + 6}) {
    if (D.size() != known) continue;
    if (!AllZero(D, kRational)) return Unsupported(lens, "zeros for thin prism and tilt (from the ninth on)");
    double* const targets[] = {&camera->k1, &camera->k2, &camera->p1, &camera->p2,
                               &camera->k3, &camera->k4, &camera->k5, &camera->k6};
    for (std::size_t i = 0; i < std::min(D.size(), kRational); ++i) *targets[i] = D[i];
    return true;
  }
  return Unsupported(lens, "k1 k2 p1 p2 k3, and k4 k5 k6 of rational_polynomial");
}

}  // namespace planar_vslam
