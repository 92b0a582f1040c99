; One of three vegetables is sliced already; all are to be sliced and in the bowl.
(define (problem three-kinds-one-sliced)
  (:domain cooking)
  (:objects
    carrot potato tomato - veggie
    bowl - container
    chopping_knife - cuttool
    black_tray - location
    wooden_board - workspace
    robotic_gripper robotic_gripper2 - gripper)
  (:init
    (at carrot black_tray) (is-whole carrot) (available carrot)
    (at potato black_tray) (is-whole potato) (available potato)
    (at tomato wooden_board) (is-sliced tomato) (available tomato)
    (at bowl black_tray) (available bowl)
    (carry robotic_gripper2 chopping_knife) (free robotic_gripper))
  (:goal (forall (?v - veggie) (and (is-sliced ?v) (in ?v bowl)))))
