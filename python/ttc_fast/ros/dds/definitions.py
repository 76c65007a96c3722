"""Definitions of the messages that are read and sent, with the hashes that ROS 2 gives their types.

Only fields, in the words of the ``.msg`` files; comments and constants are left out, which are not part of a type. A
type that is named without a package is of the same one, as in ROS.
"""

from __future__ import annotations

DEFINITIONS = {
    "builtin_interfaces/Time": "int32 sec; uint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec; uint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp; string frame_id",
    "std_msgs/Bool": "bool data",
    "std_msgs/Float32": "float32 data",
    "std_msgs/Float64": "float64 data",
    "std_msgs/ColorRGBA": "float32 r; float32 g; float32 b; float32 a",
    "geometry_msgs/Point": "float64 x; float64 y; float64 z",
    "geometry_msgs/Vector3": "float64 x; float64 y; float64 z",
    "geometry_msgs/Quaternion": "float64 x; float64 y; float64 z; float64 w",
    "geometry_msgs/Pose": "Point position; Quaternion orientation",
    "geometry_msgs/PoseWithCovariance": "Pose pose; float64[36] covariance",
    "geometry_msgs/Twist": "Vector3 linear; Vector3 angular",
    "geometry_msgs/TwistWithCovariance": "Twist twist; float64[36] covariance",
    "nav_msgs/Odometry": (
        "std_msgs/Header header; string child_frame_id; geometry_msgs/PoseWithCovariance pose; "
        "geometry_msgs/TwistWithCovariance twist"
    ),
    "sensor_msgs/LaserScan": (
        "std_msgs/Header header; float32 angle_min; float32 angle_max; float32 angle_increment; "
        "float32 time_increment; float32 scan_time; float32 range_min; float32 range_max; float32[] ranges; "
        "float32[] intensities"
    ),
    "sensor_msgs/PointField": "string name; uint32 offset; uint8 datatype; uint32 count",
    "sensor_msgs/PointCloud2": (
        "std_msgs/Header header; uint32 height; uint32 width; PointField[] fields; bool is_bigendian; "
        "uint32 point_step; uint32 row_step; uint8[] data; bool is_dense"
    ),
    "sensor_msgs/CompressedImage": "std_msgs/Header header; string format; uint8[] data",
    "ackermann_msgs/AckermannDrive": (
        "float32 steering_angle; float32 steering_angle_velocity; float32 speed; float32 acceleration; float32 jerk"
    ),
    "ackermann_msgs/AckermannDriveStamped": "std_msgs/Header header; AckermannDrive drive",
    "diagnostic_msgs/KeyValue": "string key; string value",
    "diagnostic_msgs/DiagnosticStatus": (
        "byte level; string name; string message; string hardware_id; KeyValue[] values"
    ),
    "diagnostic_msgs/DiagnosticArray": "std_msgs/Header header; DiagnosticStatus[] status",
    "visualization_msgs/UVCoordinate": "float32 u; float32 v",
    "visualization_msgs/MeshFile": "string filename; uint8[] data",
    "visualization_msgs/Marker": (
        "std_msgs/Header header; string ns; int32 id; int32 type; int32 action; geometry_msgs/Pose pose; "
        "geometry_msgs/Vector3 scale; std_msgs/ColorRGBA color; builtin_interfaces/Duration lifetime; "
        "bool frame_locked; geometry_msgs/Point[] points; std_msgs/ColorRGBA[] colors; string texture_resource; "
        "sensor_msgs/CompressedImage texture; UVCoordinate[] uv_coordinates; string text; string mesh_resource; "
        "MeshFile mesh_file; bool mesh_use_embedded_materials"
    ),
    "rmw_dds_common/Gid": "char[16] data",
    "rmw_dds_common/NodeEntitiesInfo": (
        "string<=256 node_namespace; string<=256 node_name; Gid[] reader_gid_seq; Gid[] writer_gid_seq"
    ),
    "rmw_dds_common/ParticipantEntitiesInfo": "Gid gid; NodeEntitiesInfo[] node_entities_info_seq",
}
"""By name: type and name of each field [common_interfaces, ackermann_msgs and rmw_dds_common, Humble to Jazzy]."""

GID_OF_HUMBLE = {"rmw_dds_common/Gid": "char[24] data"}
"""Up to ROS 2 Humble a Gid had 24 bytes; from Iron on it has 16."""

HASHES = {
    "nav_msgs/Odometry": "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "sensor_msgs/LaserScan": "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
    "sensor_msgs/PointCloud2": "9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5",
    "std_msgs/Bool": "feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9",
    "std_msgs/Float32": "7170d3d8f841f7be3172ce5f4f59f3a4d7f63b0447e8b33327601ad64d83d6e2",
    "std_msgs/Float64": "705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a",
    "ackermann_msgs/AckermannDriveStamped": "48ca7612a08d3bb72744fd98b71b7cf2ea24c6ad50fa4e1aa0bbad963c90d8cf",
    "diagnostic_msgs/DiagnosticArray": "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    "visualization_msgs/Marker": "45b13ccf791f225962bf74e746f9644518855d783a6f42ba0cc14fde2b4f3ce0",
    "rmw_dds_common/ParticipantEntitiesInfo": "e725f4a506958c79f95dd693b965722c57b19cd18e7eff984f49561b93dc985d",
}
"""Hashes of version 1 (RIHS01), as ``rosbags`` computes it from the definitions."""
