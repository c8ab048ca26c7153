#include "services/formats/files/json_kinds.h"

#include <google/protobuf/util/json_util.h>

#include <array>
#include <memory>
#include <utility>

#include "absl/strings/str_cat.h"
#include "weft/v1/avatar.pb.h"
#include "weft/v1/board.pb.h"
#include "weft/v1/body.pb.h"
#include "weft/v1/calibration.pb.h"
#include "weft/v1/comparison.pb.h"
#include "weft/v1/dataset.pb.h"
#include "weft/v1/evaluation.pb.h"
#include "weft/v1/job.pb.h"
#include "weft/v1/report.pb.h"
#include "weft/v1/rig.pb.h"
#include "weft/v1/rig_plan.pb.h"
#include "weft/v1/session.pb.h"
#include "weft/v1/take.pb.h"
#include "weft/v1/template.pb.h"

namespace weft {
namespace {

struct Kind {
  const google::protobuf::Message* message;
  const char* name;
};

const auto& Kinds() {
  static const std::array kKinds = {
      Kind{&v1::Rig::default_instance(), "a rig (rig.json)"},
      Kind{&v1::Template::default_instance(), "a template (template.json)"},
      Kind{&v1::Board::default_instance(), "a board (board.json)"},
      Kind{&v1::Session::default_instance(), "a session (session.json)"},
      Kind{&v1::CalibrationTarget::default_instance(), "a calibration target (target.json)"},
      Kind{&v1::Take::default_instance(), "a take (take.json)"},
      Kind{&v1::Job::default_instance(), "a job (job.json)"},
      Kind{&v1::FrameReport::default_instance(), "the report of a frame (report.json)"},
      Kind{&v1::Evaluation::default_instance(), "an evaluation (evaluation.json)"},
      Kind{&v1::Comparison::default_instance(), "a comparison (comparison.json)"},
      Kind{&v1::RigPlan::default_instance(), "a plan of a rig (plan.json)"},
      Kind{&v1::CalibrationReport::default_instance(), "the report of a calibration (rig.report.json)"},
      Kind{&v1::Dataset::default_instance(), "a data set (dataset.json)"},
      Kind{&v1::Body::default_instance(), "a body (.body)"},
      Kind{&v1::Avatar::default_instance(), "an avatar (avatar.json)"},
  };
  return kKinds;
}

// What a kind makes of the text; null where it does not fit.
std::unique_ptr<google::protobuf::Message> ReadAs(const Kind& kind, std::string_view text) {
  std::unique_ptr<google::protobuf::Message> message(kind.message->New());
  const google::protobuf::StringPiece json(text.data(), text.size());
  return google::protobuf::util::JsonStringToMessage(json, message.get()).ok() ? std::move(message) : nullptr;
}

}  // namespace

std::string OtherKind(std::string_view text, const google::protobuf::Message& wanted) {
  // Trees of messages are many times as large as their text.
  constexpr size_t kMostBytes = 4 << 20;
  if (text.size() > kMostBytes) return "";
  const Kind *found = nullptr, *asked = nullptr;
  size_t most_bytes = 0;
  for (const Kind& kind : Kinds()) {
    if (kind.message->GetDescriptor() == wanted.GetDescriptor()) {
      asked = &kind;
      continue;
    }
    const std::unique_ptr<google::protobuf::Message> message = ReadAs(kind, text);
    if (message == nullptr || message->ByteSizeLong() <= most_bytes) continue;
    found = &kind;
    most_bytes = message->ByteSizeLong();
  }
  if (found == nullptr || asked == nullptr) return "";
  return absl::StrCat("this is ", found->name, ", and ", asked->name, " is wanted");
}

}  // namespace weft
