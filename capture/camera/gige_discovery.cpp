#include "capture/camera/gige_discovery.h"

#include <arv.h>

namespace weft {
namespace {

std::string Text(const char* text) { return text != nullptr ? text : ""; }

}  // namespace

std::vector<FoundCamera> FindGigeCameras() {
  arv_update_device_list();
  std::vector<FoundCamera> found;
  for (guint i = 0; i < arv_get_n_devices(); ++i) {
    if (Text(arv_get_device_protocol(i)) != "GigEVision") continue;
    found.push_back({Text(arv_get_device_vendor(i)), Text(arv_get_device_model(i)),
                     Text(arv_get_device_serial_nbr(i)), Text(arv_get_device_address(i))});
  }
  return found;
}

}  // namespace weft
