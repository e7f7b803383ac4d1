#pragma once
// Random numbers that are the same with every standard library, unlike those of <random>'s distributions.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <random>
#include <utility>
#include <vector>

namespace planar_vslam::sim {

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : generator_(seed) {}

  // Within [low, high).
  double Uniform(double low, double high) {
    constexpr double kUnit = 1.0 / 9007199254740992.0;  // 2^-53
    return low + (high - low) * kUnit * static_cast<double>(generator_() >> 11);
  }
  // Within middle +- reach, the likelier the nearer to the middle (triangular).
  double Around(double middle, double reach) {
    return middle + 0.5 * reach * (Uniform(-1.0, 1.0) + Uniform(-1.0, 1.0));
  }
  // As likely from 1 to 2 as from 2 to 4.
  double LogUniform(double low, double high) { return std::exp(Uniform(std::log(low), std::log(high))); }
  // Waiting for something that happens every `mean` on average.
  double Exponential(double mean) { return -mean * std::log(1.0 - Uniform(0.0, 1.0)); }
  bool Chance(double probability) { return Uniform(0.0, 1.0) < probability; }
  double Sign() { return Chance(0.5) ? 1.0 : -1.0; }
  // Both ends included.
  int Whole(int low, int high) { return std::min(high, low + static_cast<int>(Uniform(0.0, high - low + 1.0))); }
  template <class Item>
  const Item& Pick(const std::vector<Item>& items) {
    return items[static_cast<std::size_t>(Whole(0, static_cast<int>(items.size()) - 1))];
  }
  // Each with its weight.
  template <class Item>
  Item Weighted(std::initializer_list<std::pair<double, Item>> items) {
    double total = 0.0;
    for (const auto& [weight, item] : items) total += weight;
    double left = Uniform(0.0, total);
    for (const auto& [weight, item] : items) {
      left -= weight;
      if (left < 0.0) return item;
    }
    return std::prev(items.end())->second;
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace planar_vslam::sim
