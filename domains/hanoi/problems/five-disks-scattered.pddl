; Five disks over three pegs, in a legal order, are gathered on the right peg.
(define (problem five-disks-scattered)
  (:domain hanoi)
  (:objects
    red_disk orange_disk yellow_disk green_disk blue_disk - disk
    left_peg middle_peg right_peg - peg)
  (:init
    (on-peg orange_disk left_peg)
    (clear orange_disk)
    (on-peg red_disk middle_peg) (on-peg green_disk middle_peg)
    (on green_disk red_disk) (clear green_disk)
    (on-peg yellow_disk right_peg) (on-peg blue_disk right_peg)
    (on blue_disk yellow_disk) (clear blue_disk)
    (smaller orange_disk red_disk) (smaller yellow_disk red_disk) (smaller green_disk red_disk)
    (smaller blue_disk red_disk)
    (smaller yellow_disk orange_disk) (smaller green_disk orange_disk)
    (smaller blue_disk orange_disk)
    (smaller green_disk yellow_disk) (smaller blue_disk yellow_disk)
    (smaller blue_disk green_disk))
  (:goal (forall (?d - disk) (on-peg ?d right_peg))))
