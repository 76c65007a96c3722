"""What a sensor's message passes before anything is decided by it, whoever brings it: a bag, DDS, rospy or rclpy.

A message says more than its readings: where its beams point, in which frame it was measured and when. Drivers fill
these fields in their own ways. Node and replay hand every message to the same objects, in this order:

``frames``
    Of which sensor is it? Messages of two ``frame_id`` on one topic are of two sensors, which are never mixed.
``transforms``
    Where does that sensor sit on the vehicle? ``/tf_static`` says it, unless the user does.
``clock``
    When was it measured? A stamp of 0 is none, and a stamp that stands still is no new measurement.
``scans``
    Where do the beams of a scan point? Each scan says it for itself. The kernels of a geometry are made once and kept,
    and the brake goes on with what it remembers when the geometry changes.
``clouds``, by ``ttc_fast.pointcloud2``
    Where do the points of a cloud lie in its message, and which of their bytes are x, y and z? Where are they in the
    frame of the vehicle, and which of them are at the height of obstacles?
``odometry``
    How does the vehicle move? A twist that nobody filled in is derived from the poses, and one that contradicts the
    poses of the same odometry is corrected if it is of the frame of the world, and is not used otherwise.
``oddities``
    What is odd but usable is counted by a ``Tally``, and said once. What is unusable raises ``RefusedError``, whose one
    sentence says why: a node counts it and brakes, a replay counts it as lost.

What comes out is plain: a geometry with its readings, a motion, a time in seconds. From there on node and replay call
the same brake, and decide alike.
"""
