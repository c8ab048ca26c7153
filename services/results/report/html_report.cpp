#include "services/results/report/html_report.h"

#include <openssl/sha.h>

#include "absl/strings/str_cat.h"
#include "services/results/report/html_text.h"
#include "services/results/report/job_report_parts.h"
#include "services/results/report/job_summary.h"
#include "services/results/report/job_verdict.h"
#include "services/results/report/report_sections.h"
#include "services/results/report/report_style.h"
#include "services/results/report/verdict_html.h"

namespace weft {

namespace {

// "script-src 'sha256-...'": nothing else of the page may run, whatever a camera is called.
std::string PolicyOf(const std::string& script) {
  if (script.empty()) return "";
  std::string hash(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(script.data()), script.size(),
         reinterpret_cast<unsigned char*>(hash.data()));
  return absl::StrCat("; script-src 'sha256-", Base64(hash), "'");
}

}  // namespace

std::string Page(const std::string& title, const std::string& body, const PageProgram& program) {
  return absl::StrCat(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; style-src "
      "'unsafe-inline'",
      PolicyOf(program.script),
      "\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta name=\"color-scheme\" content=\"light dark\">\n<title>",
      EscapeHtml(title), "</title>\n<style>\n", kReportStyle, "</style>\n</head>\n<body>\n<main>\n", body,
      "</main>\n", program.data,
      program.script.empty() ? "" : absl::StrCat("<script>", program.script, "</script>\n"),
      "</body>\n</html>\n");
}

namespace {

// Results of earlier versions have no verdict, and a job that runs has none yet.
v1::Job WithVerdict(v1::Job job, const std::vector<v1::FrameReport>& frames) {
  const bool is_over = job.state() != v1::JOB_STATE_QUEUED && job.state() != v1::JOB_STATE_RUNNING;
  if (!is_over) {
    job.clear_verdict();
  } else if (job.verdict().grade() == v1::GRADE_UNSPECIFIED) {
    *job.mutable_verdict() = AssessJob(job, frames);
  }
  return job;
}

}  // namespace

std::string JobVerdictSection(const JobReportParts& parts) {
  const v1::Job job = WithVerdict(parts.job, parts.frames);
  const JobSummary summary = Summarize(job, parts.frames);
  return Section("job", "The job", VerdictBlock(Headline(job, summary), job.verdict()));
}

}  // namespace weft
