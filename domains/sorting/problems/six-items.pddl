; Three boxes and three cylinders, one of each in the wrong tray, are to be sorted by kind.
(define (problem six-items)
  (:domain sorting)
  (:objects red_box yellow_box purple_box - box
            green_cylinder blue_cylinder pink_cylinder - cylinder
            left_tray right_tray - tray
            arm - robot)
  (:init (handempty arm)
         (ontable red_box) (ontable yellow_box) (in purple_box right_tray)
         (ontable green_cylinder) (ontable blue_cylinder) (in pink_cylinder left_tray))
  (:goal (and (forall (?x - box) (in ?x left_tray))
              (forall (?x - cylinder) (in ?x right_tray)))))
