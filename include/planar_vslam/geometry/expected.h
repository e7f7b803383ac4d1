#pragma once
// Expected failure as a value: Expected<T> holds a T, or an Error that says what, where and what to do, in one line.
#include <string>
#include <utility>
#include <variant>

#include "planar_vslam/geometry/check.h"

namespace planar_vslam {

struct Error {
  std::string message;
};

template <class T>
class Expected {
 public:
  Expected(T value) : content_(std::move(value)) {}  // NOLINT(google-explicit-constructor): reads as "return value;"
  Expected(Error error) : content_(std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const { return std::holds_alternative<T>(content_); }
  explicit operator bool() const { return ok(); }

  const T& value() const& {
    PV_CHECK(ok(), error().message);
    return std::get<T>(content_);
  }
  T& value() & {
    PV_CHECK(ok(), error().message);
    return std::get<T>(content_);
  }
  T&& value() && {
    PV_CHECK(ok(), error().message);
    return std::get<T>(std::move(content_));
  }
  const Error& error() const { return std::get<Error>(content_); }

  const T& operator*() const& { return value(); }
  T& operator*() & { return value(); }
  const T* operator->() const { return &value(); }
  T* operator->() { return &value(); }

 private:
  std::variant<T, Error> content_;
};

}  // namespace planar_vslam
