; A box on the table and one in the wrong tray, and a cylinder, are to be sorted by kind.
(define (problem three-items)
  (:domain sorting)
  (:objects red_box blue_box - box
            green_cylinder - cylinder
            left_tray right_tray - tray
            arm - robot)
  (:init (handempty arm)
         (ontable red_box) (in blue_box right_tray) (ontable green_cylinder))
  (:goal (and (forall (?x - box) (in ?x left_tray))
              (forall (?x - cylinder) (in ?x right_tray)))))
