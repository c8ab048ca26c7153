#include "capture/file/name_forms.h"

#include <glib.h>

#include <memory>

#include "absl/strings/ascii.h"

namespace weft {
namespace {

struct Free {
  void operator()(char* text) const { g_free(text); }
};
using GlibText = std::unique_ptr<char, Free>;

// Whether a whole number begins at `i`.
bool StartsNumber(std::string_view name, size_t i) {
  if (i == 0) return true;
  const bool is_fraction = i > 1 && name[i - 1] == '.' && IsDigit(name[i - 2]);
  return !IsDigit(name[i - 1]) && !is_fraction;
}

}  // namespace

bool IsDigit(char c) { return absl::ascii_isdigit(static_cast<unsigned char>(c)); }

std::string ComposedName(const std::string& name) {
  const GlibText composed(g_utf8_normalize(name.data(), static_cast<gssize>(name.size()), G_NORMALIZE_NFC));
  return composed == nullptr ? name : composed.get();
}

std::string CaselessName(const std::string& name) {
  const std::string composed = ComposedName(name);
  if (!g_utf8_validate(composed.data(), static_cast<gssize>(composed.size()), nullptr)) return composed;
  const GlibText folded(g_utf8_casefold(composed.data(), static_cast<gssize>(composed.size())));
  return ComposedName(folded.get());
}

std::string NameWithoutZeros(std::string_view name) {
  std::string out;
  for (size_t i = 0; i < name.size(); ++i) {
    if (StartsNumber(name, i)) {
      while (name[i] == '0' && i + 1 < name.size() && IsDigit(name[i + 1])) ++i;
    }
    out += name[i];
  }
  return out;
}

}  // namespace weft
