// Errors of GLib.
#pragma once

#include <string>

struct _GError;

namespace weft {

// Receives an error of GLib and frees it.
class GlibError {
 public:
  GlibError() = default;
  ~GlibError();
  GlibError(const GlibError&) = delete;
  GlibError& operator=(const GlibError&) = delete;
  _GError** out() { return &error_; }
  bool ok() const { return error_ == nullptr; }
  std::string message() const;

 private:
  _GError* error_ = nullptr;
};

}  // namespace weft
