// The controls of V4l2Device.
#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "absl/strings/string_view.h"
#include "base/status_macros.h"
#include "capture/camera/v4l2_device.h"
#include "capture/camera/v4l2_ioctl.h"

namespace weft {
namespace {

std::string Plain(absl::string_view name) {
  std::string plain;
  for (const char c : name)
    if (absl::ascii_isalnum(static_cast<unsigned char>(c)))
      plain += absl::ascii_tolower(static_cast<unsigned char>(c));
  return plain;
}

std::pair<std::string, std::string> Parts(const std::string& assignment) {
  const size_t at = assignment.find('=');
  if (at == std::string::npos) return {assignment, ""};
  return {assignment.substr(0, at), assignment.substr(at + 1)};
}

}  // namespace

struct V4l2Device::Control {
  v4l2_query_ext_ctrl info{};

  std::string name() const { return info.name; }
  bool IsMenu() const { return info.type == V4L2_CTRL_TYPE_MENU || info.type == V4L2_CTRL_TYPE_INTEGER_MENU; }
  bool IsNumber() const {
    return info.type == V4L2_CTRL_TYPE_INTEGER || info.type == V4L2_CTRL_TYPE_INTEGER64 ||
           info.type == V4L2_CTRL_TYPE_BOOLEAN || info.type == V4L2_CTRL_TYPE_BITMASK;
  }
  bool IsButton() const { return info.type == V4L2_CTRL_TYPE_BUTTON; }
  bool IsKnown() const {
    return (info.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_HAS_PAYLOAD)) == 0 &&
           (IsMenu() || IsNumber() || IsButton());
  }
};

std::vector<V4l2Device::Control> V4l2Device::AllControls() const {
  std::vector<Control> controls;
  Control control;
  control.info.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (V4l2Ioctl(fd_, VIDIOC_QUERY_EXT_CTRL, &control.info) == 0) {
    if (control.IsKnown()) controls.push_back(control);
    const uint32_t id = control.info.id;
    control.info = {};
    control.info.id = id | V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return controls;
}

absl::StatusOr<V4l2Device::Control> V4l2Device::FindControl(const std::string& name) const {
  std::vector<std::string> names;
  for (const Control& control : AllControls()) {
    if (Plain(control.name()) == Plain(name)) return control;
    names.push_back(control.name());
  }
  return Refused(absl::StrCat("it has no control ", name, "; it has ", absl::StrJoin(names, ", ")));
}

std::vector<std::string> V4l2Device::Menu(const Control& control) const {
  std::vector<std::string> entries;
  for (int64_t index = control.info.minimum; index <= control.info.maximum; ++index) {
    v4l2_querymenu entry{};
    entry.id = control.info.id;
    entry.index = static_cast<uint32_t>(index);
    const bool exists = V4l2Ioctl(fd_, VIDIOC_QUERYMENU, &entry) == 0;
    const bool is_number = control.info.type == V4L2_CTRL_TYPE_INTEGER_MENU;
    entries.push_back(!exists     ? ""
                      : is_number ? absl::StrCat(static_cast<int64_t>(entry.value))
                                  : std::string(reinterpret_cast<const char*>(entry.name)));
  }
  return entries;
}

std::string V4l2Device::AllowedValues(const Control& control) const {
  if (control.IsButton()) return "a button: give its name alone";
  if (control.info.type == V4L2_CTRL_TYPE_BOOLEAN) return "0 or 1";
  if (control.IsMenu()) {
    std::vector<std::string> entries = Menu(control);
    std::erase(entries, "");
    return absl::StrJoin(entries, ", ");
  }
  const v4l2_query_ext_ctrl& info = control.info;
  std::string text =
      absl::StrCat(static_cast<int64_t>(info.minimum), " to ", static_cast<int64_t>(info.maximum));
  if (info.step > 1) absl::StrAppend(&text, " in steps of ", static_cast<uint64_t>(info.step));
  return text;
}

absl::StatusOr<int64_t> V4l2Device::ParseValue(const Control& control, const std::string& value) const {
  const v4l2_query_ext_ctrl& info = control.info;
  if (control.IsMenu()) {
    const std::vector<std::string> entries = Menu(control);
    for (size_t i = 0; i < entries.size(); ++i)
      if (!entries[i].empty() && Plain(entries[i]) == Plain(value))
        return info.minimum + static_cast<int64_t>(i);
  }
  int64_t number = 0;
  bool truth = false;
  if (info.type == V4L2_CTRL_TYPE_BOOLEAN && absl::SimpleAtob(value, &truth)) return truth ? 1 : 0;
  const bool fits = !control.IsMenu() && !control.IsButton() && absl::SimpleAtoi(value, &number) &&
                    (info.type == V4L2_CTRL_TYPE_BITMASK ||
                     (number >= info.minimum && number <= info.maximum &&
                      (info.step == 0 || static_cast<uint64_t>(number - info.minimum) % info.step == 0)));
  if (fits || (control.IsButton() && value.empty())) return number;
  return Refused(absl::StrCat("its control ", control.name(), " does not take \"", value,
                              "\"; allowed: ", AllowedValues(control)));
}

absl::Status V4l2Device::SetControl(const std::string& assignment) {
  const auto [name, text] = Parts(assignment);
  WEFT_ASSIGN_OR_RETURN(Control control, FindControl(name));
  WEFT_ASSIGN_OR_RETURN(const int64_t value, ParseValue(control, text));
  if ((control.info.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0)
    return Refused(absl::StrCat("its control ", control.name(), " can only be read"));
  if ((control.info.flags & (V4L2_CTRL_FLAG_INACTIVE | V4L2_CTRL_FLAG_GRABBED)) != 0)
    return Refused(
        absl::StrCat("its control ", control.name(),
                     " has no effect while another one rules it (an automatic one?) or the camera is in "
                     "use; set that one first"));
  v4l2_ext_control one{};
  one.id = control.info.id;
  one.value64 = value;
  if (control.info.type != V4L2_CTRL_TYPE_INTEGER64) one.value = static_cast<int32_t>(value);
  v4l2_ext_controls all{};
  all.count = 1;
  all.controls = &one;
  if (V4l2Ioctl(fd_, VIDIOC_S_EXT_CTRLS, &all) != 0)
    return Refused(absl::StrCat("its control ", control.name(), " refuses \"", text, "\" (",
                                std::strerror(errno), "); allowed: ", AllowedValues(control)));
  return absl::OkStatus();
}

void V4l2Device::WatchControl(const std::string& assignment) {
  const absl::StatusOr<Control> control = FindControl(Parts(assignment).first);
  if (!control.ok()) return;
  v4l2_event_subscription subscription{};
  subscription.type = V4L2_EVENT_CTRL;
  subscription.id = control->info.id;
  V4l2Ioctl(fd_, VIDIOC_SUBSCRIBE_EVENT, &subscription);
}

void V4l2Device::WatchSource() {
  v4l2_event_subscription subscription{};
  subscription.type = V4L2_EVENT_SOURCE_CHANGE;
  V4l2Ioctl(fd_, VIDIOC_SUBSCRIBE_EVENT, &subscription);
}

std::string V4l2Device::ControlName(uint32_t id) const {
  Control control;
  control.info.id = id;
  return V4l2Ioctl(fd_, VIDIOC_QUERY_EXT_CTRL, &control.info) == 0 ? control.name() : "";
}

std::string V4l2Device::Value(const Control& control) const {
  v4l2_ext_control one{};
  one.id = control.info.id;
  v4l2_ext_controls all{};
  all.count = 1;
  all.controls = &one;
  const bool is_readable = !control.IsButton() && (control.info.flags & V4L2_CTRL_FLAG_WRITE_ONLY) == 0;
  if (!is_readable || V4l2Ioctl(fd_, VIDIOC_G_EXT_CTRLS, &all) != 0) return "";
  const int64_t value = control.info.type == V4L2_CTRL_TYPE_INTEGER64 ? one.value64 : one.value;
  if (!control.IsMenu()) return absl::StrCat(value);
  const std::vector<std::string> entries = Menu(control);
  const auto index = static_cast<size_t>(value - control.info.minimum);
  return index < entries.size() ? entries[index] : absl::StrCat(value);
}

std::vector<std::string> V4l2Device::Controls() const {
  std::vector<std::string> lines;
  for (const Control& control : AllControls()) {
    const std::string value = Value(control);
    lines.push_back(
        absl::StrCat(control.name(), value.empty() ? "" : " = ", value, " (", AllowedValues(control), ")"));
  }
  return lines;
}

std::map<std::string, std::string> V4l2Device::ControlValues() const {
  std::map<std::string, std::string> values;
  for (const Control& control : AllControls())
    if (std::string value = Value(control); !value.empty()) values[control.name()] = std::move(value);
  return values;
}

}  // namespace weft
