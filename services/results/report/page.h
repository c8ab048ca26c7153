// Pages of reports: one HTML file that loads nothing and shows itself with the program in page/.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace google::protobuf {
class Message;
}

namespace weft {

struct ReportPage {
  std::string title;  // not escaped
  std::string kind;   // as page/*.js defines it: "job"
  // Members of the object that the page's program gets: protobuf's JSON with the field names of the schema
  // and with zeros; 64-bit numbers and what is no number are text; no message is null.
  std::vector<std::pair<std::string, const google::protobuf::Message*>> data;
};

// Its policy lets nothing run but the program, and loads nothing: pictures are part of the data. Characters
// that are no UTF-8 are left out. The same bytes for the same arguments.
std::string MakePage(const ReportPage& page);

}  // namespace weft
