#include "capture/camera/glib_error.h"

#include <glib.h>

namespace weft {

GlibError::~GlibError() { g_clear_error(&error_); }

std::string GlibError::message() const { return error_ != nullptr ? error_->message : ""; }

}  // namespace weft
