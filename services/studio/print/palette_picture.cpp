#include "services/studio/print/palette_picture.h"

#include <cairo.h>

#include <algorithm>
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "services/formats/files/atomic_file.h"

namespace weft {
namespace {

constexpr int kBox = 76, kLeft = 120, kTop = 110;

void Text(cairo_t* context, double x, double y, double size, const std::string& text) {
  cairo_set_source_rgb(context, 0.1, 0.1, 0.1);
  cairo_set_font_size(context, size);
  cairo_move_to(context, x, y);
  cairo_show_text(context, text.c_str());
}

void Swatch(cairo_t* context, double x, double y, double width, double height, const PaletteInk& ink) {
  cairo_set_source_rgb(context, std::min(1.0, ink.mean[0] / 255.0), std::min(1.0, ink.mean[1] / 255.0),
                       std::min(1.0, ink.mean[2] / 255.0));
  cairo_rectangle(context, x, y, width, height);
  cairo_fill(context);
}

void Entry(cairo_t* context, const PaletteReport& report, int a, int b) {
  const double x = kLeft + b * kBox, y = kTop + a * kBox, separation = report.separation[a][b];
  if (a == b || separation <= 0) return;
  // Red for weak pairs, yellow for those between, green for safe ones.
  if (separation < kWeakSeparation) {
    cairo_set_source_rgb(context, 1, 0.72, 0.68);
  } else if (separation < kSafeSeparation) {
    cairo_set_source_rgb(context, 1, 0.94, 0.7);
  } else {
    cairo_set_source_rgb(context, 0.84, 0.95, 0.84);
  }
  cairo_rectangle(context, x + 1, y + 1, kBox - 2, kBox - 2);
  cairo_fill(context);
  Text(context, x + 12, y + 34, 20, absl::StrFormat("%.1f", separation));
  if (report.confusion[a][b] > 0)
    Text(context, x + 12, y + 58, 13, absl::StrFormat("%.2f %%", 100 * report.confusion[a][b]));
}

cairo_status_t KeepBytes(void* text, const unsigned char* bytes, unsigned int size) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(bytes), size);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

absl::Status WritePalettePicture(const PaletteReport& report, const std::string& path) {
  const int width = kLeft + kCellColors * kBox + 20, height = kTop + kCellColors * kBox + 80;
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height), &cairo_surface_destroy);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> owner(cairo_create(surface.get()), &cairo_destroy);
  cairo_t* context = owner.get();
  cairo_set_source_rgb(context, 1, 1, 1);
  cairo_paint(context);
  cairo_select_font_face(context, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  Text(context, 20, 30, 18, "Separation of the inks, in units of their scatter");
  for (int k = 0; k < kCellColors; ++k) {
    const std::string name(CellColorName(static_cast<CellColor>(k)));
    Swatch(context, kLeft + k * kBox + 4, kTop - 58, kBox - 8, 30, report.inks[k]);
    Text(context, kLeft + k * kBox + 4, kTop - 10, 13, name);
    Swatch(context, 16, kTop + k * kBox + 8, 30, kBox - 16, report.inks[k]);
    Text(context, 52, kTop + k * kBox + kBox / 2 + 5, 13, name);
    for (int b = 0; b < kCellColors; ++b) Entry(context, report, k, b);
  }
  Text(context, 20, height - 54, 13,
       absl::StrFormat("Red: below %.0f, easily mistaken; yellow: below %.0f.", kWeakSeparation,
                       kSafeSeparation));
  Text(context, 20, height - 34, 13, "Small: share of the row's ink that is read as the column's.");
  Text(context, 20, height - 14, 13,
       absl::StrCat("Weakest: ", std::string(CellColorName(report.weakest_a)), " and ",
                    std::string(CellColorName(report.weakest_b)), "."));
  cairo_surface_flush(surface.get());
  std::string bytes;
  const cairo_status_t status = cairo_surface_write_to_png_stream(surface.get(), &KeepBytes, &bytes);
  if (status == CAIRO_STATUS_SUCCESS) return WriteFileAtomically(path, bytes);
  return absl::UnavailableError(absl::StrCat(path, ": cannot be written: ", cairo_status_to_string(status)));
}

}  // namespace weft
