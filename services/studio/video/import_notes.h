// What is to be said of videos that became a take.
#pragma once

#include <string>
#include <vector>

#include "services/studio/video/imported_take.h"

namespace weft {

// The offset of each camera and what told it, the timecode; as warnings: variable rates, damage,
// interlaced films, pictures that are hidden or of one time, clips that are shorter than the take, frames in
// no set, offsets that are not sure.
std::vector<LedgerNote> NotesOn(const ImportedTake& imported);

// The note with the file that it is about.
std::string WarningOf(const LedgerNote& note, const std::vector<v1::VideoFacts>& videos);

}  // namespace weft
