(define (problem b_middles)
  (:domain sorting)
  (:objects left_tray - tray right_tray - tray red_box - box yellow_box - box purple_box - box green_cylinder - cylinder blue_cylinder - cylinder pink_cylinder - cylinder)
  (:init
    (in green_cylinder right_tray)
    (in red_box left_tray))
  (:goal (and))
)
