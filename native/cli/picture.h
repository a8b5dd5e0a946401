// Pictures of sessions and of merged shards to EXR files that say what they hold.
#pragma once

#include <string>

#include "film/shard.h"
#include "session/render_session.h"

namespace pharos::cli {

// Of the samples that the session has taken from `offset` on. Throws WriteError.
void write_picture(const RenderSession& session,
                   ShardInfo info,
                   std::uint32_t offset,
                   const std::string& path);

void write_merged(const MergedPicture& picture, const std::string& path);

}  // namespace pharos::cli
