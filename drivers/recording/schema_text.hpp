// The IDL files as text, which a recording carries so that any reader can decode it.
#pragma once

#include <string_view>

namespace perimap {

extern const std::string_view kPerimapSchemaText;           // idl/perimap.idl
extern const std::string_view kPerimapMeshSchemaText;       // idl/perimap_mesh.idl
extern const std::string_view kPerimapProcedureSchemaText;  // idl/perimap_procedure.idl
extern const std::string_view kPerimapToolSchemaText;       // idl/perimap_tool.idl
extern const std::string_view kPerimapTraceSchemaText;      // idl/perimap_trace.idl
extern const std::string_view kFoxgloveSchemaText;          // idl/foxglove/foxglove.idl

}  // namespace perimap
