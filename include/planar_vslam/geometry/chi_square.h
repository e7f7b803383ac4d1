#pragma once
// Quantiles of the chi-square distribution, by degrees of freedom and per cent: what a squared error, weighted by its
// covariance, exceeds as rarely as that.

namespace planar_vslam {

inline constexpr double kChi2OneDof95 = 3.841;
inline constexpr double kChi2TwoDof95 = 5.991;  // a reprojection error
inline constexpr double kChi2ThreeDof90 = 6.251;
inline constexpr double kChi2ThreeDof95 = 7.815;
inline constexpr double kChi2ThreeDof99 = 11.345;
inline constexpr double kChi2ThreeDof999 = 16.266;  // a pose on the floor
inline constexpr double kChi2FiveDof999 = 20.515;

}  // namespace planar_vslam
