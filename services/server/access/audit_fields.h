// What an entry of the audit log says of a request and its answer.
#pragma once

#include <google/protobuf/message.h>

#include "weft/v1/access.pb.h"

namespace weft {

// Fields of a message that tell what it is about, into `about`: text, numbers and words, at most 16, by their
// names ("spec.dump"). Secrets, empty ones and long texts' ends are left out.
void DescribeRequest(const google::protobuf::Message& request, v1::AuditEntry& entry);
// What an answer calls the thing that it is about: "id", "upload_id" and the like.
void DescribeAnswer(const google::protobuf::Message& answer, v1::AuditEntry& entry);

}  // namespace weft
